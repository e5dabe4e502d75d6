//! Many courses side by side, in rounds: the one way in which many cone programs are solved at once.
//!
//! What becomes of a configuration, a specimen or a direction is a course of programs, each of which follows from the
//! answers before. A course is an asynchronous function that waits for its answers; when all courses of a chunk wait,
//! their programs are solved together, those of one structure eight at a time, and the courses go on. Courses may wait
//! at other [`Desk`]s as well, for other work that is better done together. There is no thread and no timer behind it,
//! and a single course goes the same way.

use std::cell::{Cell, RefCell};
use std::future::{Future, poll_fn};
use std::mem::discriminant;
use std::pin::{Pin, pin};
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use rayon::prelude::*;

use crate::cone::answer::{Answer, Outcome};
use crate::cone::lanes::layout::Question;
use crate::cone::lanes::programs::Programs;
use crate::cone::{Block, Program, Springs};
use crate::interrupt;

/// Courses of a chunk: enough to fill eight lanes in the last rounds, too.
pub(crate) const CHUNK: usize = 64;

/// Where courses ask for work of one kind and wait for what comes of it.
pub(crate) struct Desk<Q, A> {
    asked: RefCell<Vec<(Q, Slot<A>)>>,
}

/// Where what comes of it is put.
type Slot<A> = Rc<Cell<Option<A>>>;

impl<Q, A> Default for Desk<Q, A> {
    fn default() -> Self {
        Self { asked: RefCell::default() }
    }
}

impl<Q, A> Desk<Q, A> {
    /// What comes of it, in the next round.
    pub async fn ask(&self, what: Q) -> A {
        let slot = Slot::default();
        self.asked.borrow_mut().push((what, Rc::clone(&slot)));
        poll_fn(|_| slot.take().map_or(Poll::Pending, Poll::Ready)).await
    }

    /// Does all that has been asked for, in its order; tells whether it was anything.
    pub fn serve(&self, work: impl FnOnce(Vec<Q>) -> Vec<A>) -> bool {
        let (asked, slots): (Vec<Q>, Vec<Slot<A>>) = self.asked.take().into_iter().unzip();
        if asked.is_empty() {
            return false;
        }
        let done = work(asked);
        assert_eq!(slots.len(), done.len(), "what is asked for is done");
        slots.iter().zip(done).for_each(|(slot, done)| slot.set(Some(done)));
        true
    }
}

/// Where courses hand in their programs.
#[derive(Clone, Default)]
pub(crate) struct Rounds {
    programs: Rc<Desk<Asked, Answer>>,
    alone: Rc<Cell<u64>>,
    roughly: bool,
}

struct Asked {
    question: Question,
    program: Program,
    roughly: bool,
}

impl Rounds {
    /// The same rounds for programs whose last digits do not matter: as programs solved together prove them is enough.
    pub fn roughly(&self) -> Self {
        Self { roughly: true, ..self.clone() }
    }

    /// The answer to a program: from one nearby where that leads there, or in the next round.
    pub async fn solve(&self, question: Question, program: &Program, near: Option<&Answer>) -> Answer {
        // Springs alone are linear: any start is as good.
        let linear = question == Question::Pose && program.blocks.iter().all(|block| block.kind.set().is_none());
        let start = linear.then(|| Answer::pushed(program));
        if let Some(answer) = near.or(start.as_ref()).and_then(|near| program.answer_near(question, near)) {
            return answer;
        }
        self.ask(question, program.clone()).await
    }

    /// The answer to a program, in the next round.
    pub async fn ask(&self, question: Question, program: Program) -> Answer {
        self.programs.ask(Asked { question, program, roughly: self.roughly }).await
    }

    /// Takes a course for every item, all of them side by side.
    pub fn each<I, T>(items: impl Iterator<Item = I>, course: impl AsyncFn(&Self, I) -> T) -> Vec<T> {
        Self::each_beside(items, course, || false)
    }

    /// The same for courses that wait at other desks, too. What has been asked for there is done by `serve`, which
    /// tells whether it was anything, when no course waits for a program any more: so all gather there.
    #[allow(clippy::needless_pass_by_value)] // courses borrow the function, which callers write in place
    pub fn each_beside<I, T>(
        items: impl Iterator<Item = I>,
        course: impl AsyncFn(&Self, I) -> T,
        mut serve: impl FnMut() -> bool,
    ) -> Vec<T> {
        let rounds = Self::default();
        let mut courses: Vec<_> = items.map(|item| Box::pin(course(&rounds, item))).collect();
        let mut ends: Vec<Option<T>> = courses.iter().map(|_| None).collect();
        loop {
            for (course, end) in courses.iter_mut().zip(&mut ends).filter(|(_, end)| end.is_none()) {
                interrupt::check();
                *end = go_on(course.as_mut());
            }
            // Courses wait at the desks and nowhere else.
            if !rounds.solve_asked() && !serve() {
                assert!(ends.iter().all(Option::is_some), "courses wait at the desks and nowhere else");
                return ends.into_iter().flatten().collect();
            }
        }
    }

    /// The same for chunks of so many courses, on all threads.
    pub fn each_in_chunks<I: Sync, T: Send>(
        items: &[I],
        size: usize,
        course: impl AsyncFn(&Self, &I) -> T + Sync,
    ) -> Vec<T> {
        let chunks = items.par_chunks(size).map(|chunk| Self::each(chunk.iter(), &course));
        chunks.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Takes one course.
    pub fn alone<T>(course: impl AsyncFnOnce(&Self) -> T) -> T {
        let rounds = Self::default();
        let mut course = pin!(course(&rounds));
        loop {
            if let Some(end) = go_on(course.as_mut()) {
                return end;
            }
            interrupt::check();
            assert!(rounds.solve_asked(), "a course by itself waits for programs and nothing else");
        }
    }

    /// Programs that were solved by themselves, because neither eight at a time nor Newton's method proved an answer.
    pub fn alone_so_far(&self) -> u64 {
        self.alone.get()
    }

    /// Solves the programs that have been handed in; tells whether there were any.
    fn solve_asked(&self) -> bool {
        self.programs.serve(|asked| {
            let mut structures: Vec<Vec<usize>> = Vec::new();
            for (number, one) in asked.iter().enumerate() {
                match structures.iter_mut().find(|others| one.is_like(&asked[others[0]])) {
                    Some(others) => others.push(number),
                    None => structures.push(vec![number]),
                }
            }
            let mut answers: Vec<Option<Answer>> = vec![None; asked.len()];
            for numbers in structures {
                let programs: Vec<&Program> = numbers.iter().map(|&number| &asked[number].program).collect();
                let together = Programs::of(&programs);
                let solved = together.solve_here(asked[numbers[0]].question);
                for (k, number) in numbers.into_iter().enumerate() {
                    answers[number] = Some(self.finished(&asked[number], solved.answer(&together, k)));
                }
            }
            answers.into_iter().flatten().collect()
        })
    }

    /// An answer with as many digits as are asked for.
    fn finished(&self, Asked { question, program, roughly }: &Asked, answer: Answer) -> Answer {
        if *roughly {
            return answer;
        }
        program.polished(*question, &answer).unwrap_or_else(|| {
            self.alone.set(self.alone.get() + 1);
            program.alone(*question)
        })
    }
}

/// Takes a course to the next program or to its end.
fn go_on<F: Future>(course: Pin<&mut F>) -> Option<F::Output> {
    match course.poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(end) => Some(end),
        Poll::Pending => None,
    }
}

impl Program {
    /// The answer to the last digits. An interior point is good to the root of its gap where the value is flat; where
    /// Newton's method does not take it further, the program is to be solved by itself, which goes a little further.
    fn polished(&self, question: Question, answer: &Answer) -> Option<Answer> {
        if answer.outcome == Outcome::Infeasible { Some(answer.clone()) } else { self.answer_near(question, answer) }
    }

    /// The answer of a program solved by itself.
    fn alone(&self, question: Question) -> Answer {
        match question {
            Question::Pose => self.pose(),
            Question::Assembly => self.assembly(Springs::Rigid),
        }
    }
}

impl Asked {
    /// Whether the same is asked of programs with the same numbers of equations and the same kinds of blocks.
    fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.program, &other.program);
        let same = |(a, b): (&Block, &Block)| {
            discriminant(&a.kind) == discriminant(&b.kind)
                && a.size() == b.size()
                && a.kind.set().map(discriminant) == b.kind.set().map(discriminant)
        };
        self.question == other.question
            && a.n_equations() == b.n_equations()
            && a.blocks.len() == b.blocks.len()
            && a.blocks.iter().zip(&b.blocks).all(same)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cone::Kind;

    /// What a spring of this compliance and another one give so that both add up to one.
    fn springs(compliance: f64, blocks: usize) -> Program {
        let block = |k: usize| Block {
            kind: Kind::Spring(vec![compliance * (k + 1) as f64]),
            map: vec![1.0],
            force: vec![0.0],
        };
        Program { right: vec![1.0], blocks: (0..blocks).map(block).collect() }
    }

    #[test]
    fn every_course_gets_its_own_answers_whatever_others_ask_for() {
        let shares = Rounds::each(0..20, async |rounds, k: usize| {
            // Unlike structures, unlike numbers of programs.
            let mut shares = Vec::new();
            for step in 0..k % 4 {
                let answer = rounds.ask(Question::Pose, springs((k + 1) as f64, 2 + (k + step) % 3)).await;
                shares.push((answer.displacements[0][0], 2 + (k + step) % 3));
            }
            shares
        });
        for (k, shares) in shares.into_iter().enumerate() {
            assert_eq!(shares.len(), k % 4);
            for (share, n) in shares {
                // Springs in a row share by their compliances, 1, 2, .. n.
                assert!((share * (n * (n + 1) / 2) as f64 - 1.0).abs() < 1e-9, "{k} {n} {share}");
            }
        }
    }

    #[test]
    fn courses_gather_at_a_desk_until_none_waits_for_a_program() {
        let (desk, served) = (Desk::default(), RefCell::new(Vec::new()));
        let ends = Rounds::each_beside(
            0..5,
            async |rounds, k: usize| {
                for _ in 0..k {
                    rounds.ask(Question::Pose, springs(1.0, 2)).await;
                }
                (desk.ask(k).await, desk.ask(100).await)
            },
            || {
                desk.serve(|asked: Vec<usize>| {
                    served.borrow_mut().push(asked.len());
                    asked.into_iter().map(|k| 10 * k).collect()
                })
            },
        );
        assert_eq!(ends, [0, 10, 20, 30, 40].map(|end| (end, 1000)));
        assert_eq!(served.into_inner(), [5, 5]);
    }

    #[test]
    fn chunks_end_in_the_order_of_their_items() {
        let items: Vec<usize> = (0..100).collect();
        let ends = Rounds::each_in_chunks(&items, 8, async |rounds, &k| {
            rounds.solve(Question::Pose, &springs(1.0, 1 + k % 3), None).await;
            k
        });
        assert_eq!(ends, items);
    }
}
