//! Many courses of programs side by side, in rounds.
//!
//! What becomes of a configuration is a course of programs, each of which follows from the answers before. A
//! course is an asynchronous function that waits for its answers; when all courses of a chunk wait, their programs
//! are solved together, those of one structure eight at a time, and the courses go on. There is no thread and no
//! timer behind it, and a single course goes the same way.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::future::{Future, poll_fn};
use std::mem::discriminant;
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

use crate::cone::answer::{Answer, Outcome};
use crate::cone::lanes::layout::Question;
use crate::cone::lanes::programs::Programs;
use crate::cone::{Block, Program, Springs};
use crate::interrupt;

/// Where courses hand in their programs.
#[derive(Default)]
pub(crate) struct Rounds {
    asked: RefCell<Vec<Asked>>,
    answers: RefCell<HashMap<usize, Answer>>,
    tickets: Cell<usize>,
    alone: Cell<u64>,
}

struct Asked {
    ticket: usize,
    question: Question,
    program: Program,
}

impl Rounds {
    /// The answer to a program: from one nearby where that leads there, or in the next round.
    pub async fn solve(&self, question: Question, program: &Program, near: Option<&Answer>) -> Answer {
        // Springs alone are linear: any start is as good.
        let linear = question == Question::Pose && program.blocks.iter().all(|block| block.kind.set().is_none());
        let start = linear.then(|| Answer::pushed(program));
        if let Some(answer) = near.or(start.as_ref()).and_then(|near| program.answer_near(question, near)) {
            return answer;
        }
        let ticket = self.hand_in(question, program.clone());
        poll_fn(|_| self.answers.borrow_mut().remove(&ticket).map_or(Poll::Pending, Poll::Ready)).await
    }

    fn hand_in(&self, question: Question, program: Program) -> usize {
        let ticket = self.tickets.get();
        self.tickets.set(ticket + 1);
        self.asked.borrow_mut().push(Asked { ticket, question, program });
        ticket
    }

    /// Takes a course for every item, all of them side by side.
    #[allow(clippy::needless_pass_by_value)] // courses borrow the function, which callers write in place
    pub fn each<I, T>(items: impl Iterator<Item = I>, course: impl AsyncFn(&Self, I) -> T) -> Vec<T> {
        let rounds = Self::default();
        let mut courses: Vec<_> = items.map(|item| Box::pin(course(&rounds, item))).collect();
        let mut ends: Vec<Option<T>> = courses.iter().map(|_| None).collect();
        loop {
            for (course, end) in courses.iter_mut().zip(&mut ends).filter(|(_, end)| end.is_none()) {
                interrupt::check();
                *end = go_on(course.as_mut());
            }
            // Courses wait for answers and for nothing else.
            if rounds.asked.borrow().is_empty() {
                return ends.into_iter().flatten().collect();
            }
            rounds.solve_asked();
        }
    }

    /// Programs that were solved by themselves, because neither eight at a time nor Newton's method proved an answer.
    pub fn alone_so_far(&self) -> u64 {
        self.alone.get()
    }

    /// Takes one course.
    pub fn alone<T>(course: impl AsyncFnOnce(&Self) -> T) -> T {
        let rounds = Self::default();
        let mut course = pin!(course(&rounds));
        loop {
            if let Some(end) = go_on(course.as_mut()) {
                return end;
            }
            rounds.solve_asked();
        }
    }

    /// Solves the programs that have been handed in.
    fn solve_asked(&self) {
        let mut structures: Vec<(Question, Vec<usize>, Vec<Program>)> = Vec::new();
        for Asked { ticket, question, program } in self.asked.borrow_mut().drain(..) {
            let same = |(other, _, programs): &&mut (Question, Vec<usize>, Vec<Program>)| {
                *other == question && alike(&programs[0], &program)
            };
            match structures.iter_mut().find(same) {
                Some((_, tickets, programs)) => {
                    tickets.push(ticket);
                    programs.push(program);
                }
                None => structures.push((question, vec![ticket], vec![program])),
            }
        }
        let mut answers = self.answers.borrow_mut();
        for (question, tickets, programs) in structures {
            let together = Programs::of(&programs);
            let solved = together.solve_here(question);
            for (k, (ticket, program)) in tickets.into_iter().zip(&programs).enumerate() {
                let answer = solved.answer(&together, k);
                let polished = program.polished(question, &answer);
                self.alone.set(self.alone.get() + u64::from(polished.is_none()));
                answers.insert(ticket, polished.unwrap_or_else(|| program.alone(question)));
            }
        }
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

/// Whether programs have the same numbers of equations and the same kinds of blocks.
fn alike(a: &Program, b: &Program) -> bool {
    let same = |(a, b): (&Block, &Block)| {
        discriminant(&a.kind) == discriminant(&b.kind)
            && a.size() == b.size()
            && a.kind.set().map(discriminant) == b.kind.set().map(discriminant)
    };
    a.n_equations() == b.n_equations() && a.blocks.len() == b.blocks.len() && a.blocks.iter().zip(&b.blocks).all(same)
}
