// The page to draw a mechanism and to play with it. What is shown follows from `asked`, what the sliders and choices say; every change of it has
// a larger serial number. One question is on its way at a time: what changes meanwhile is asked when the answer is there, and only
// the newest. When the sliders rest, the exact answers are asked for, one after the other, until something changes again.

import { view } from "./viewer.js";
import { Board, TOOLS } from "./board.js";
import { bars, chart, short } from "./charts.js";
import { animated, exported } from "./export.js";
import { History, forget, unsaved } from "./history.js";
import { Inspector } from "./inspector.js";
import { parsed } from "./numbers.js";
import { Picture, keepPicture, pictureOf } from "./picture.js";
import { Play } from "./play.js";
import { element, slider } from "./sliders.js";
import { Tour } from "./tour.js";
import { Variants } from "./variants.js";

const QUANTITIES = ["position", "rotation"];
const GROUPS = { clearances: "Clearances", tolerances: "Tolerances", loads: "Loads" };
// Milliseconds after the last key in the text until it is read.
const TYPED = 600;

const at = (id) => document.getElementById(id);
let open = null; // what the server said of the mechanism
let viewer = null;
let asked = {};
let shown = { here: {}, path: {} };
let isAsking = false;
let isHeld = false;
let settling = null;
let openings = 0;
let history = null;
// What was changed last, for messages; and the poses that are shown, for gestures.
let touched = "";
// What was said of the position of the sliders, which ends with it.
let placing = null;
let poses = {};
// Whether errors have said how much they are magnified.
let magnified = false;
// Edits are made one after the other, each of the state that the one before has left.
let editing = Promise.resolve();

// ---- asking -----------------------------------------------------------------------------------------------------------------------

async function post(name, told, signal) {
  const response = await fetch(name, { method: "POST", body: JSON.stringify(told), signal });
  const found = await response.json();
  if (!response.ok) throw new Error(found.error);
  return found;
}

function said(words, isAlarm = false) {
  at("note").textContent = words;
  at("note").classList.toggle("alarm", isAlarm);
}

/** Whether what is shown is of other values than those that stand in the fields: then it is dimmed. */
const stale = (is) => document.body.classList.toggle("stale", is);

/** Runs something that can be refused, and says why. */
async function trying(run) {
  try {
    return await run();
  } catch (problem) {
    if (problem.name !== "AbortError") said(problem instanceof TypeError ? "the server does not answer; is it still running?" : problem.message, true);
    return null;
  }
}

function changed(part) {
  asked = { ...asked, ...part, serial: asked.serial + 1 };
  settling?.abort();
  settling = null;
  mark();
  ask();
}

const isTable = (value) => value !== null && typeof value === "object";
const hasAnswers = () => Boolean(open?.questions) && !open.problem;

async function ask() {
  if (isAsking || !hasAnswers()) return;
  isAsking = true;
  const mine = asked;
  const { page, serial } = mine;
  let problem = null;
  const found = await post("now", mine).catch((error) => ((problem = error), null));
  isAsking = false;
  if (page !== asked.page) return ask();
  if (problem) {
    await trying(() => Promise.reject(touched && !(problem instanceof TypeError) ? new Error(`${touched}: ${problem.message}`) : problem));
    placing = at("note").textContent;
    stale(true);
  }
  if (found && !found.cancelled) show(found, mine);
  if (serial !== asked.serial) ask();
  else if (found) settle();
}

/** The exact answers, if the sliders rest. */
async function settle() {
  if (isHeld || isAsking || settling || document.body.dataset.state !== "rough") return;
  const mine = (settling = new AbortController());
  for (let samples = 0, next = -1; next !== 0; samples = next) {
    const found = await trying(() => post("settled", { ...asked, samples }, mine.signal));
    if (mine.signal.aborted) return;
    if (!found) placing = at("note").textContent;
    if (!found || found.cancelled) return;
    show(found, asked);
    next = found.next;
  }
  settling = null;
  mark("exact");
}

// ---- showing ----------------------------------------------------------------------------------------------------------------------

/** What the errors along the path depend on. */
const pathKey = ({ page, values, output, load_case }) => JSON.stringify([page, values, output, load_case]);

const isPossible = (question) => open.loads || !open.questions[question].needs_loads;

function mark(state = "rough") {
  document.body.dataset.state = state;
  document.body.dataset.serial = asked.serial;
}

function show(found, mine) {
  if (!found.exact) {
    shown.here = {};
    // What else stands there, such as that a file could not be saved, is left.
    if (found.problem || at("note").textContent === placing) said(found.problem ?? "", Boolean(found.problem));
    placing = found.problem ?? null;
  }
  for (const [question, answer] of Object.entries(found.here ?? {})) shown.here[question] = { ...answer, exact: found.exact || !open.questions[question].is_rough };
  if (shown.path.key !== pathKey(mine)) shown.path = { key: pathKey(mine) };
  for (const [question, answer] of Object.entries(found.path ?? {})) {
    // Where only the drives have moved, what is exact along the path stays so.
    if (!found.exact && shown.path[question]?.exact) continue;
    shown.path[question] = { ...answer, exact: found.exact || !open.questions[question].is_rough, samples: found.samples };
  }
  if (found.forces) shown.path.of_forces = found.forces;
  stale(false);
  document.body.classList.toggle("unplaced", Boolean(found.problem));
  if (found.scene) {
    poses = found.poses ?? poses;
    board.now = mine.drives;
    viewer.update(found.scene);
    board.mark();
    if (Object.values(found.here ?? {}).some(({ position, rotation }) => position.value || rotation.value)) magnify();
  }
  if (found.transmission !== undefined) transmitted(found.transmission);
  document.body.dataset.shown = found.serial;
  document.body.dataset.milliseconds = found.milliseconds;
  answer();
  numbers();
  along();
}

/** Errors are magnified as the largest ones ask for, those of the worst case; once, as soon as there are some. */
async function magnify() {
  if (magnified) return;
  magnified = true;
  const mine = openings;
  const found = await post("now", { ...asked, question: "worst" }).catch(() => null);
  if (mine !== openings) return;
  if (found?.scene) viewer.magnify(found.scene.factor);
  else magnified = false;
}

function transmitted(told) {
  at("transmission").textContent = told?.text ?? "";
  at("transmission").classList.toggle("alarm", Boolean(told?.alarm));
}

const wordOf = (question, answer) => (question === "random" && answer.samples ? `${answer.samples.toLocaleString("en")} specimens` : answer.exact ? "exact" : "to first order");

function answer() {
  const own = shown.here[asked.question];
  const words = own?.sentences ?? [{ text: isPossible(asked.question) ? "" : "Nothing loads the mechanism." }];
  at("answer").replaceChildren(...words.map(sentence));
  bars(at("shares"), own?.position.shares ?? []);
}

function sentence({ text, alarm, state }) {
  const line = Object.assign(document.createElement("p"), { textContent: text });
  if (state) line.classList.add(state.replace(" ", "-"));
  else line.classList.toggle("alarm", Boolean(alarm));
  return line;
}

/** What is said of the limits of forces; nothing where the file has none. They are found when the sliders rest. */
function forces() {
  if (!open.forces) return [];
  const found = shown.path.of_forces ?? { outcome: "not shown", brief: "…", sentences: [], tables: [] };
  return [{ rests: shown.path.of_forces ? "for forces" : "for forces, which are found when the sliders rest", ...found }];
}

/** A table of forces, with what misses its limit marked. */
function tableOf({ title, columns }) {
  const table = element("table", { className: "forces" });
  element("caption", { textContent: title }, table);
  const row = (parent, kind, words) => {
    const line = element("tr", {}, parent);
    words.forEach(([text, isAlarm], k) => element(k ? kind : "th", { textContent: text, className: isAlarm ? "missed" : "" }, line));
  };
  row(table.createTHead(), "th", columns.map(({ head }) => [head]));
  const body = table.createTBody();
  columns[0].cells.forEach((_, k) => row(body, "td", columns.map(({ cells, alarms }) => [cells[k], alarms.includes(k)])));
  return table;
}

/** The verdict over all questions along the path, the worst outcome first; it says what it rests on. */
function whole(questions) {
  const words = { missed: "✗ Limits missed: ", "not shown": "? Not shown: ", held: "✓ Limits hold " };
  const every = [...questions.map((name) => shown.path[name]), ...forces()];
  const groups = Object.keys(words).map((state) => [state, every.filter((own) => own.outcome === state)]).filter(([, found]) => found.length);
  if (!groups.length) return [];
  const text = groups.map(([state, found], k) => (k ? `${state}: ` : words[state]) + found.map((own) => own.rests).join(", ")).join("; ");
  return [sentence({ text: `${text}.`, state: groups[0][0] })];
}

function numbers() {
  const rows = Object.entries(open.questions).filter(([question]) => shown.here[question]).map(([question, { words }]) => {
    const own = shown.here[question];
    const row = element("tr", { className: question });
    row.dataset.question = question;
    row.classList.toggle("rough", !own.exact);
    const values = QUANTITIES.map((name) => {
      const { value, unit, most } = own[name];
      const cell = element("td", { textContent: value === null ? "–" : most == null ? `${short(value)} ${unit}` : `up to ${short(most)} ${unit}` });
      cell.dataset.value = value;
      return cell;
    });
    row.append(element("th", { textContent: question === "random" ? `${words}, 95 %` : words }), ...values, element("td", { textContent: own.status === "undetermined" ? "undetermined" : wordOf(question, own) }));
    return row;
  });
  at("numbers").tBodies[0].replaceChildren(...rows);
}

function along() {
  const questions = Object.keys(open.questions).filter((question) => shown.path[question]);
  const single = open.drives.length === 1;
  const x = open.along.map((row, k) => (single ? row[0] : k));
  const here = single ? asked.drives[0] : open.drives.length ? Number(at("along-path")?.value ?? NaN) : null;
  const components = [...new Set(questions.flatMap((name) => Object.keys(shown.path[name].components)))];
  const of = (own, quantity) => own?.[quantity] ?? own?.components[quantity];
  // Of a component the lowest and the highest error are two lines of one question.
  const linesOf = (path, quantity, behind = "") =>
    questions.flatMap((name) => {
      const own = of(path[name], quantity);
      return (own?.lines ?? (own ? [own.values] : [])).map((values) => ({ name: `${name}${behind}`, values, exact: path[name].exact }));
    });
  const charts = [...QUANTITIES, ...components].map((quantity) => {
    const place = document.createElement("div");
    const curves = linesOf(shown.path, quantity);
    // Those of a variant that is a ghost lie behind, where it has as many configurations.
    const behind = linesOf(variants.seen?.path ?? {}, quantity, " behind").filter(({ values }) => values.length === x.length);
    if (curves.length) {
      const { unit, limit = null, limits = limit === null ? [] : [limit] } = questions.map((name) => of(shown.path[name], quantity)).find(Boolean);
      const label = single ? `${open.drives[0].name} [${open.drives[0].unit}]` : "configuration";
      const isFixed = open.problem || components.includes(quantity) || isTable(open.board.limits[quantity]);
      chart(place, { title: quantity, unit, label, x, curves: [...behind, ...curves], limits, here: Number.isFinite(here) ? here : null, limited: isFixed ? null : (value) => (value === null ? along() : edit({ edits: [[["limits", quantity], value]] })) });
    }
    return place;
  });
  if (!at("charts").querySelector(".grip.held")) at("charts").replaceChildren(...charts);
  const rough = questions.filter((question) => !shown.path[question].exact);
  at("state").textContent = rough.length ? "not yet exact" : questions.length ? "exact" : "";
  at("state").className = rough.length ? "rough" : "";
  const words = questions.flatMap((question) => {
    const own = shown.path[question];
    const head = element("p", { className: `key ${question}`, textContent: `${open.questions[question].words} (${wordOf(question, own)})` });
    return [head, ...own.sentences.slice(0, 3).map(sentence)];
  });
  const ofForces = forces().flatMap(({ sentences, tables }) => [element("p", { className: "key", textContent: "forces in the worst case" }), ...sentences.map(sentence), ...tables.map(tableOf)]);
  at("verdict").replaceChildren(...whole(questions), ...words, ...ofForces);
  variants.filled();
  line();
}

/** The verdict of every question in one line that is always seen; a click leads to its cause. */
function line() {
  const questions = Object.keys(open.questions ?? {}).filter((question) => shown.path[question]);
  const words = { missed: "✗", held: "✓", "not shown": "?" };
  const parts = questions.map((question) => {
    const { outcome, brief, exact } = shown.path[question];
    const part = element("button", { type: "button", className: (outcome || "no-limit").replace(" ", "-"), textContent: `${words[outcome] ?? ""} ${open.questions[question].words}: ${brief}${exact ? "" : " …"}` });
    part.dataset.question = question;
    part.addEventListener("click", () => {
      document.querySelector(`[name=question][value=${question}]`)?.click();
      at("said").scrollIntoView({ behavior: "smooth", block: "nearest" });
    });
    return part;
  });
  for (const { outcome, brief } of hasAnswers() || open.problem ? forces() : []) {
    const part = element("button", { type: "button", className: (outcome || "no-limit").replace(" ", "-"), textContent: `${words[outcome] ?? ""} forces: ${brief}` });
    part.dataset.question = "forces";
    part.addEventListener("click", () => at("verdict").lastElementChild?.scrollIntoView({ behavior: "smooth", block: "nearest" }));
    parts.push(part);
  }
  const missing = open.problem ? [open.problem.text] : (open.board?.missing ?? []).slice(0, 1).map(({ text }) => text);
  const rest = open.problem || !hasAnswers() ? missing.map((text) => element("span", { className: "alarm", textContent: text })) : [];
  at("line").replaceChildren(...rest, ...(open.problem || hasAnswers() ? parts : []));
}

// ---- sliders ----------------------------------------------------------------------------------------------------------------------

let play = null;
// What sets the sliders of drives, and of offsets by name.
let drivesTo = [];
let offsetsTo = {};

function moves() {
  const place = at("moves");
  place.replaceChildren();
  drivesTo = [];
  play?.stop();
  play = null;
  const rows = open.along.filter((row) => row.every((v) => v !== null));
  if (rows.length > 1 && open.drives.length) {
    const label = element("label", { className: "path" }, place);
    element("span", { textContent: "along the path" }, label);
    const range = element("input", { type: "range", id: "along-path", min: 0, max: rows.length - 1, step: "any", value: Math.floor(rows.length / 2) }, label);
    range.addEventListener("input", () => follow(Number(range.value)));
    const [begin, end] = [rows[0], rows.at(-1)].map((row) => open.scene.places[open.along.indexOf(row)]);
    const closed = rows.length > 2 && begin.flat().every((v, k) => Math.abs(v - end.flat()[k]) < 1e-4 * open.scene.extent);
    play = new Play(element("div", { id: "play" }, place), {
      count: rows.length,
      closed,
      moved: (at) => {
        isHeld = true;
        follow(at);
      },
      rested: () => {
        isHeld = false;
        settle();
      },
    });
  }
  drivesTo = open.drives.map((drive, k) =>
    slider(place, { ...drive, words: drive.name, value: asked.drives[k] }, (value) => changed({ drives: asked.drives.with(k, value) })),
  );
}

/** Moves the drives to a place along the path, between its configurations as well. */
function follow(place) {
  // A text that has a problem has no path.
  if (!open.along) return;
  const rows = open.along.filter((row) => row.every((v) => v !== null));
  const k = Math.min(Math.floor(place), rows.length - 2);
  const drives = rows[k].map((v, d) => v + (place - k) * (rows[k + 1][d] - v));
  drives.forEach((value, d) => drivesTo[d](value));
  at("along-path").value = place;
  changed({ drives });
}

function knobs() {
  const place = at("knobs");
  place.replaceChildren();
  for (const [group, title] of Object.entries(GROUPS)) {
    const own = open.knobs.filter((knob) => knob.group === group);
    if (!own.length) continue;
    const box = element("details", { open: own.length <= 12 || group !== "tolerances" }, place);
    element("summary", { textContent: title }, box);
    for (const knob of own) {
      const words = `${knob.name} ${knob.measure}`;
      const value = asked.values[knob.key] ?? knob.value;
      slider(
        box,
        { ...knob, name: knob.key, words, value },
        (next) => {
          touched = words;
          changed({ values: { ...asked.values, [knob.key]: next } });
        },
        done,
      );
    }
  }
  const box = element("details", { open: true, id: "offsets", hidden: !open.questions[asked.question].takes_offsets }, place);
  element("summary", { textContent: "Given offsets" }, box);
  const worst = element("button", { type: "button", textContent: "as at the largest position error" }, box);
  worst.addEventListener("click", () => {
    const offsets = shown.here.worst?.offsets;
    if (!offsets) return;
    for (const [name, value] of Object.entries(offsets)) offsetsTo[name]?.(value);
    changed({ offsets });
    done();
  });
  offsetsTo = {};
  for (const one of open.offsets) offsetsTo[one.name] = slider(box, { ...one, words: one.name, value: asked.offsets[one.name] ?? 0 }, (value) => changed({ offsets: { ...asked.offsets, [one.name]: value } }), done);
  const back = element("button", { type: "button", textContent: "everything as in the file" }, place);
  back.addEventListener("click", () => {
    changed({ values: {}, offsets: {} });
    knobs();
    done();
  });
}

function questions() {
  const place = at("questions");
  place.replaceChildren(place.firstElementChild);
  for (const [question, { words, takes_offsets }] of Object.entries(open.questions)) {
    const label = element("label", { className: `key ${question}` }, place);
    const radio = element("input", { type: "radio", name: "question", value: question, checked: question === asked.question, disabled: !isPossible(question) }, label);
    label.append(` ${words}`);
    radio.addEventListener("input", () => {
      at("offsets").hidden = !takes_offsets;
      changed({ question });
    });
  }
}

function choices() {
  const place = at("choices");
  place.replaceChildren();
  for (const [key, words, names] of [["output", "output", open.outputs], ["load_case", "load case", open.cases]]) {
    if (!names.length) continue;
    const label = element("label", { textContent: `${words} ` }, place);
    const select = element("select", {}, label);
    for (const name of names) element("option", { value: name, textContent: name }, select);
    select.addEventListener("input", () => changed({ [key]: select.value }));
  }
}

/** A step that can be undone: what sliders have changed. */
function done() {
  history?.push({ ...history.now, values: asked.values, offsets: asked.offsets, label: touched || "slider" });
  shownText();
}

/** The text with what sliders have changed of it, where it is shown. */
async function shownText() {
  const isTyping = () => document.activeElement === at("text");
  if (!at("file").open || isTyping()) return;
  const { page } = asked;
  const found = open.problem ? { text: open.text } : await trying(() => post("text", asked));
  // What somebody has begun to type meanwhile is left.
  if (found && page === asked.page && !isTyping()) at("text").value = found.text;
}

// ---- the board --------------------------------------------------------------------------------------------------------------------

export const board = new Board({
  told: (gesture) => edit(gesture),
  chosen: (ref) => inspector.show(open.board, ref),
  followed: (place) => at("along-path") && follow(place),
  said: (words) => said(words),
  scaled: (ends) => {
    scaling = ends;
    at("typed").focus();
    said("Type the distance of the two points.");
  },
});
// Two points of the picture whose distance is asked for; and what is copied.
let scaling = null;
let copied = "";
const inspector = new Inspector(at("inspector"), {
  told: (what) => edit(what),
  chosen: (ref) => board.choose(ref),
  copied: (body) => copy(body),
  fits: async (told) => (await trying(() => post("fits", { page: asked.page, ...told })))?.fits,
});
const tour = new Tour(at("tools"));
const variants = new Variants(at("variants"), {
  kept: () => ({ state: history.now, scene: viewer.scene, path: structuredClone(shown.path) }),
  present: () => ({ numbers: shown.here, outcome: Object.fromEntries(Object.keys(open.questions ?? {}).map((name) => [name, shown.path[name]?.brief ?? ""])), words: open.questions ?? {} }),
  restored: (state) => go(state, true),
  ghost: (scene) => viewer.ghost(scene),
  seen: () => hasAnswers() && along(),
});

function tools() {
  const place = at("tools");
  place.replaceChildren();
  const own = open.board.planar ? Object.entries(TOOLS) : Object.entries(TOOLS).slice(0, 2);
  for (const [tool, { key, words, hidden }] of own) {
    if (hidden && !board.picture) continue;
    const button = element("button", { type: "button", textContent: words, title: `key ${key.toUpperCase()}` }, place);
    button.dataset.tool = tool;
    button.setAttribute("aria-keyshortcuts", key);
    button.addEventListener("click", () => use(tool));
  }
  const drawn = element("button", { type: "button", textContent: "as drawn", title: "key Home: the drives where the file is drawn" }, place);
  drawn.addEventListener("click", asDrawn);
  if (open.board.planar) {
    const keeps = element("select", { id: "keeps", title: "key H: what stays when a joint is dragged" }, element("label", { textContent: "keeps: " }, place));
    keeps.setAttribute("aria-label", "keeps: what stays when a joint is dragged");
    keeps.setAttribute("aria-keyshortcuts", "h");
    for (const what of KEPT) element("option", { value: what, textContent: what, selected: what === board.keeps }, keeps);
    keeps.addEventListener("input", () => keep(keeps.value));
    const label = element("label", { className: "button", textContent: board.picture ? "another picture" : "picture behind", title: "to draw over; two points scale it" }, place);
    const input = element("input", { id: "picture", type: "file", accept: "image/*", hidden: true }, label);
    input.addEventListener("change", () => trying(async () => picture(await Picture.of(input.files[0], viewer))));
    if (board.picture) element("button", { type: "button", textContent: "without it" }, place).addEventListener("click", () => picture(null));
    element("button", { type: "button", id: "guide", textContent: "guide" }, place).addEventListener("click", () => tour.start(open.board));
  }
  use(open.board.planar ? board.tool : "select");
}

/** What a drag of a joint keeps: all other positions, or the lengths of the bars on it. */
const KEPT = ["positions", "lengths"];

function keep(what) {
  board.keeps = at("keeps").value = what;
  said(`A drag of a joint keeps ${what === "lengths" ? "the lengths of the bars on it" : "the positions of all others"}.`);
}

/** Another picture behind the drawing, or none. */
function picture(next) {
  board.picture = next;
  keepPicture(history.name, next);
  history.push({ ...history.now, picture: next, label: next ? "picture" : "without picture" });
  tools();
  board.mark();
}

/** A bar like another one, beside it. */
function copy(body) {
  const by = 4 * board.step();
  return edit({ gesture: "duplicate", body, by: [by, -by] });
}

function use(tool) {
  board.use(tool);
  for (const button of at("tools").querySelectorAll("[data-tool]")) button.setAttribute("aria-pressed", button.dataset.tool === tool);
  at("hint").textContent = (!open.board.planar && TOOLS[tool].spatial) || TOOLS[tool].hint;
  scaling = null;
  at("typed").hidden = !["bar", "scale"].includes(tool);
  at("typed").placeholder = tool === "scale" ? "distance, such as 120" : "30<45 or 30;40";
}

/** The drives at zero where bodies are drawn assembled: there all of them are as the file has them. */
function asDrawn() {
  if (!open.drives) return;
  const drives = open.drives.map((drive, k) => (open.board.joints.find((joint) => joint.drive === drive.name)?.drawn ? 0 : open.begin[k]));
  drives.forEach((value, d) => drivesTo[d]?.(value));
  changed({ drives });
}

function missing() {
  at("missing").replaceChildren(
    ...(open.board?.missing ?? []).map(({ text, do: what }) => {
      const row = element("li");
      const button = element("button", { type: "button", textContent: text }, row);
      button.addEventListener("click", () => {
        if (what?.gesture) edit(what);
        else if (what?.tool === "limits") document.querySelector("#limits input")?.focus();
        else if (what?.tool) what.tool === "select" ? board.choose({ all: true }) : use(what.tool);
      });
      return row;
    }),
  );
}

/** Does something when all that was asked before is done, if the mechanism is still open then. */
function inTurn(run) {
  const mine = openings;
  document.body.dataset.busy = true;
  editing = editing.then(() => (mine === openings ? trying(() => run(mine)) : null));
  const own = editing;
  return own.then(() => {
    if (own === editing) delete document.body.dataset.busy;
  });
}

/** Sends a gesture or edits, and shows the state that follows. */
function edit(what) {
  return inTurn(async (mine) => {
    touched = "";
    const sent = asked.values;
    const found = await trying(() => post("edit", { page: asked.page, values: sent, poses, ...what }));
    if (!found || found.cancelled || mine !== openings) return;
    said((found.notes ?? []).join(" "));
    // Another name is chosen as the old one was.
    if (what.rename && board.selected) for (const [key, name] of Object.entries(board.selected)) if (name === what.rename[1]) board.selected[key] = what.rename[2];
    // What sliders have changed meanwhile is not in the text yet.
    const values = Object.fromEntries(Object.entries(asked.values).filter(([key, value]) => sent[key] !== value));
    enter(found, { values, offsets: asked.offsets });
    history.push({ text: found.text, values, offsets: asked.offsets, label: labelled(what) });
  });
}

/** What was done, in a word or two, for the list of steps. */
function labelled({ gesture, edits, rename, text }) {
  if (gesture) return TOOLS[gesture]?.words ?? gesture;
  if (edits?.length) return edits[0][0].join(".");
  return rename ? `rename ${rename[1]}` : text === undefined ? "change" : "text";
}

/** Shows a state of the history, or of a variant. */
function go(state, isNew = false) {
  return inTurn(async (mine) => {
    const { text, values, offsets } = state;
    if (state.picture !== undefined && state.picture !== board.picture) {
      board.picture = state.picture;
      keepPicture(history.name, board.picture);
      tools();
      board.mark();
    }
    if (text !== open.text || open.problem) {
      const found = await trying(() => post("edit", { page: asked.page, text, poses }));
      if (!found || mine !== openings) return;
      enter(found, { values, offsets });
    } else {
      changed({ values, offsets });
      if (hasAnswers()) knobs();
      shownText();
    }
    if (isNew) history.push({ text, values, offsets, label: "taken back" });
  });
}

/** Begins with what the server said of a state of the mechanism that is open. */
function enter(found, { values, offsets }) {
  const before = open;
  open = { ...found, board: found.board ?? before.board };
  at("wrong").textContent = found.problem?.text ?? "";
  textShown(found);
  document.body.classList.toggle("draft", !found.questions && !found.problem);
  for (const id of ["knobs", "moves"]) at(id).inert = Boolean(found.problem);
  if (found.problem) {
    play?.stop();
    asked = { ...asked, page: found.page, values: {}, serial: asked.serial + 1 };
    settling?.abort();
    settling = null;
    stale(true);
    said(found.problem.text, true);
    inspector.blame(found.problem.key ?? "", found.problem.text);
    line();
    return;
  }
  stale(false);
  const names = (what) => JSON.stringify((what?.drives ?? []).map(({ name }) => name));
  const same = names(found) === names(before);
  asked = { ...asked, page: found.page, values, offsets, drives: same ? asked.drives : found.begin };
  if (found.questions && !found.questions[asked.question]) asked.question = first();
  if (found.questions && !isPossible(asked.question)) asked.question = first();
  poses = found.board.poses;
  everything(before);
}

/** The question that a page begins with. */
const first = () => Object.keys(open.questions).find(isPossible);

/** Everything that follows from what is open. */
function everything(before = null) {
  shown = { here: {}, path: {} };
  document.title = at("title").textContent = open.title || open.name || "drawing";
  drawn(before && viewer);
  missing();
  tools();
  inspector.show(open.board, board.selected);
  tour.shown(open.board);
  // Answers about another mechanism are none about this one.
  if (!before || !hasAnswers()) {
    transmitted(null);
    for (const id of ["answer", "charts", "verdict", "shares", "state", "line"]) at(id).replaceChildren();
    at("numbers").tBodies[0].replaceChildren();
  }
  if (hasAnswers()) {
    colours();
    moves();
    choices();
    questions();
    knobs();
    changed({});
  } else {
    play?.stop();
    play = null;
    for (const id of ["moves", "knobs", "choices"]) at(id).replaceChildren();
    asked = { ...asked, serial: asked.serial + 1 };
    settling?.abort();
    settling = null;
    mark("draft");
    line();
  }
}

function drawn(like) {
  at("drawing").replaceChildren();
  viewer = view(at("drawing"), { ...open.board.scene, path: open.scene?.path ?? [] }, { chosen: true });
  if (like && like.scene.axes === viewer.scene.axes) viewer.like(like);
  const ends = open.along?.filter((row) => row.every((v) => v !== null)) ?? [];
  const rows = open.along ? open.scene.places.filter((_, k) => open.along[k].every((v) => v !== null)) : [];
  Object.assign(board, { driven: (open.drives ?? []).map(({ name }) => name), now: open.begin ?? [] });
  board.on(viewer, open.board, ends.length > 1 ? rows : []);
  variants.shown();
}

// ---- the text ---------------------------------------------------------------------------------------------------------------------

let typing = null;

function textShown(found) {
  if (document.activeElement !== at("text") && at("text").value !== found.text) at("text").value = found.text;
  if (!found.problem?.line || document.activeElement === at("text")) return;
  toLine(found.problem.line);
}

/** Shows a line of the text. */
function toLine(line) {
  const rows = at("text").value.split("\n");
  const start = rows.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  at("text").setSelectionRange(start, start + (rows[line - 1] ?? "").length);
  at("text").scrollTop = (at("text").scrollHeight * (line - 3)) / rows.length;
}

at("text").addEventListener("input", () => {
  clearTimeout(typing);
  typing = setTimeout(read, TYPED);
});
at("text").addEventListener("change", read);

async function read() {
  clearTimeout(typing);
  if (at("text").value === history.now.text && !Object.keys(asked.values).length) return;
  await edit({ text: at("text").value });
  const { problem } = open;
  at("wrong").textContent = problem ? `${problem.line ? `line ${problem.line}: ` : ""}${problem.text}` : "";
}
at("wrong").addEventListener("click", () => open.problem?.line && (at("text").focus(), toLine(open.problem.line)));
at("file").addEventListener("toggle", () => open && shownText());

// ---- files ------------------------------------------------------------------------------------------------------------------------

/** Whether what is shown may be left: nothing is lost without a question. */
async function mayLeave() {
  if (!history || history.isSaved) return true;
  const dialog = at("ask");
  at("question-text").textContent = `${open.name} has changes that are not saved.`;
  dialog.returnValue = "stay";
  dialog.showModal();
  await new Promise((resolve) => dialog.addEventListener("close", resolve, { once: true }));
  if (dialog.returnValue === "save") return save();
  if (dialog.returnValue === "lose") history.lose();
  return dialog.returnValue === "lose";
}
for (const button of at("ask").querySelectorAll("button")) button.addEventListener("click", () => at("ask").close(button.value));
window.addEventListener("beforeunload", (event) => {
  if (history && !history.isSaved) event.preventDefault();
});

async function begin(what) {
  if (!(await mayLeave())) return;
  said("");
  const mine = ++openings;
  const found = await trying(() => post("open", what));
  if (!found || mine !== openings) return;
  open = found;
  tour.stop();
  Object.assign(board, { tool: "select", selected: null, pending: null, picture: pictureOf(`${folder}/${found.file || found.name}`) });
  variants.begin(`${folder}/${open.file || open.name}`, !open.file && !what.example);
  asked = { page: open.page, serial: 0, values: {}, drives: open.begin ?? [], question: open.questions ? first() : "worst", offsets: {} };
  poses = open.board.poses;
  magnified = false;
  history = new History(`${folder}/${open.file || open.name}`, { text: open.text, values: {}, offsets: {}, picture: board.picture, label: "opened" }, undoable);
  at("name").value = open.file || open.name.split("/").at(-1);
  at("text").value = open.text;
  at("wrong").textContent = "";
  document.body.classList.add("opened");
  document.body.classList.toggle("draft", !open.questions);
  undoable();
  everything();
  const left = await unsaved(history.name);
  if (mine === openings) offerLeft(left);
}

/** What was not saved when pages of this file were closed; it stands there until it is taken or thrown away. */
function offerLeft(every) {
  document.getElementById("left")?.remove();
  const place = element("div", { id: "left" });
  at("note").after(place);
  for (const { key, text, values = {}, offsets = {}, when } of every) {
    const row = element("p", { textContent: `Changes of ${new Date(when).toLocaleString()} were not saved. ` }, place);
    const add = (words, run) =>
      element("button", { type: "button", textContent: words }, row).addEventListener("click", async () => {
        if (!(await run())) return;
        row.remove();
        forget(key);
      });
    // What the server could not show is kept.
    add("take them", () => go({ text, values, offsets }, true).then(() => history.now.text === text));
    add("throw them away", () => true);
  }
}

let coloured = 0;

/** Every question has the colour of its number. */
function colours() {
  Object.keys(open.questions ?? {}).slice(coloured).forEach((name, k) => document.styleSheets[0].insertRule(`.${name} { --own: var(--own-${k}); }`));
  coloured = Object.keys(open.questions ?? {}).length || coloured;
}

function undoable() {
  at("undo").disabled = !history.past.length;
  at("redo").disabled = !history.future.length;
  const states = [...history.past, history.now, ...history.future.toReversed()];
  const options = states.map(({ label }, k) => element("option", { value: k - history.past.length, textContent: `${k}: ${label}`, selected: k === history.past.length }));
  at("steps").replaceChildren(...options.toReversed());
  document.body.dataset.saved = history.isSaved;
}

function step(back, count = 1) {
  let state = null;
  for (let k = 0; k < count; k++) state = history?.step(back) ?? state;
  if (state) go(state);
}

let folder = "";

async function offer() {
  const found = await trying(() => post("choices", {}));
  if (!found) return;
  folder = found.folder;
  const select = at("open");
  select.replaceChildren(element("option", { value: "", textContent: "…" }));
  element("option", { value: JSON.stringify({ new: true }), textContent: "an empty drawing" }, select);
  for (const [words, kind, names] of [[found.folder, "file", found.files], ["examples", "example", found.examples.map(({ name }) => name)]]) {
    const group = element("optgroup", { label: words }, select);
    for (const name of names) element("option", { value: JSON.stringify({ [kind]: name }), textContent: name }, group);
  }
  templates(found);
  return found;
}

/** What one can begin with: nothing, a file of the folder, an example. */
function templates({ files, examples, templates }) {
  const rows = [["an empty drawing", "bars, pins and guides are drawn", { new: true }], ["a guided first drawing", "a four-bar from nothing to a verdict", { new: true, guided: true }]];
  rows.push(...files.map((name) => [name, "of the folder", { file: name }]), ...templates.map((name) => [name, "drawn, with one drive", { template: name }]), ...examples.map(({ name, title }) => [name, title, { example: name }]));
  at("start").replaceChildren(
    ...rows.map(([words, title, what]) => {
      const button = element("button", { type: "button", textContent: words });
      element("small", { textContent: title }, button);
      button.addEventListener("click", async () => {
        await begin(what);
        if (what.guided && open) tour.start(open.board);
      });
      button.dataset.what = JSON.stringify(what);
      return button;
    }),
  );
  if (!open) pictures();
}

/** What the templates look like, one after the other, until one is open. */
async function pictures() {
  for (const button of [...at("start").children]) {
    const what = JSON.parse(button.dataset.what);
    if (what.new) continue;
    const { lines } = (await post("picture", what).catch(() => null)) ?? { lines: [] };
    if (open) return;
    if (lines.length) button.prepend(outlined(lines));
  }
}

function outlined(lines) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const [xs, ys] = [0, 1].map((k) => lines.flat().map((place) => place[k]));
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const room = 0.06 * Math.max(right - left, high - low);
  svg.setAttribute("viewBox", [left - room, -high - room, right - left + 2 * room, high - low + 2 * room].join(" "));
  svg.setAttribute("aria-hidden", true);
  for (const line of lines) {
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", line.map(([x, y], k) => `${k ? "L" : "M"}${x} ${-y}`).join("") + (line.length > 2 ? "Z" : ""));
    path.setAttribute("vector-effect", "non-scaling-stroke");
    svg.append(path);
  }
  return svg;
}

function download(name, kind, text) {
  const link = element("a", { download: name, href: URL.createObjectURL(text instanceof Blob ? text : new Blob([text], { type: kind })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

const stem = () => (at("name").value.replace(/\.toml$/i, "") || "mechanism");

/** Writes the file; whether it is there then. */
async function save() {
  // What is typed and not left yet counts, too.
  const field = document.activeElement;
  field?.blur?.();
  field?.focus?.({ preventScroll: true });
  await editing;
  const state = history.now;
  const found = await trying(() => post("save", { ...asked, name: at("name").value }));
  if (!found) return false;
  // What a file of another name has behind it stays there.
  if (!open.file) keepPicture(history.name, null);
  keepPicture(`${folder}/${found.file}`, board.picture);
  open.file = open.name = found.file;
  await offer();
  at("name").value = found.file;
  history.save(`${folder}/${found.file}`, state);
  variants.named(`${folder}/${found.file}`);
  said(`saved ${found.file}`);
  return true;
}

at("open").addEventListener("input", () => {
  if (at("open").value) begin(JSON.parse(at("open").value));
  at("open").selectedIndex = 0;
});
at("upload").addEventListener("change", async () => {
  const [file] = at("upload").files;
  at("upload").value = "";
  if (file) trying(async () => begin({ text: fileIn(await file.text(), file.name), name: file.name.replace(/\.html?$/i, ".toml") }));
});
/** The file in a page that was mailed, or the text itself. */
function fileIn(text, name) {
  if (!/\.html?$/i.test(name)) return text;
  const own = /<script type="application\/json" id="mechanism">(.*?)<\/script>/s.exec(text);
  if (!own) throw new Error(`${name} is a page without a mechanism in it`);
  return JSON.parse(own[1]);
}
at("undo").addEventListener("click", () => step(true));
at("redo").addEventListener("click", () => step(false));
at("steps").addEventListener("input", () => step(Number(at("steps").value) < 0, Math.abs(Number(at("steps").value))));
at("save").addEventListener("click", save);
at("download").addEventListener("click", () => trying(async () => download(`${stem()}.toml`, "application/toml", (await post("text", asked)).text)));
at("report").addEventListener("click", () =>
  trying(async () => {
    said("the report is being made …");
    download(`${stem()}.html`, "text/html", (await post("report", asked)).html);
    said("the report is saved where the browser saves files");
  }),
);
at("mail").addEventListener("click", () =>
  trying(async () => {
    said("the page is being made …");
    download(`${stem()}.html`, "text/html", (await post("page", asked)).html);
    said("the page is saved where the browser saves files: it plays without a server, and opens here again");
  }),
);
at("dxf").addEventListener("click", () => trying(async () => download(`${stem()}.dxf`, "application/dxf", (await post("dxf", asked)).dxf)));
at("animation").addEventListener("input", () => {
  const kind = at("animation").value;
  at("animation").selectedIndex = 0;
  if (!kind || !open) return;
  trying(async () => {
    if (!hasAnswers()) throw new Error("The mechanism is not complete yet: nothing moves.");
    said("the animation is being made …");
    at("animation").disabled = true;
    try {
      const found = await animated(post, { ...asked, kind }, said, at("stop"));
      if (found) download(`${stem()}${kind}`, found.type, found);
      said(found ? "the animation is saved where the browser saves files" : "the animation was stopped");
    } finally {
      at("animation").disabled = false;
    }
  });
});
for (const kind of ["svg", "png"]) at(kind).addEventListener("click", () => trying(async () => download(`${stem()}.${kind}`, "", await exported(viewer.svg, kind))));
at("typed").addEventListener("keydown", (event) => {
  if (event.key !== "Enter") return;
  if (scaling) {
    const distance = parsed(at("typed").value);
    if (!(distance > 0)) return said(`'${at("typed").value}' is not a distance`, true);
    picture(board.picture.scaled(scaling, distance));
    at("typed").value = "";
    use("select");
  } else if (board.typed(at("typed").value, parsed)) at("typed").value = "";
  else said(board.pending ? `'${at("typed").value}' is no end of a bar: 30<45 is length and angle, 30;40 to the right and up` : "Click where the bar begins first.", true);
  viewer.svg.focus({ preventScroll: true });
});

// Steps of the grid to the right and up.
const ARROWS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Moves what is chosen by a step of the grid; whether something is. */
function nudged(by) {
  const { selected } = board;
  const joint = open.board.joints.find(({ name }) => name === selected?.joint);
  const free = open.board.free.find(({ body, index }) => body === selected?.body && index === selected?.index);
  const place = joint?.at ?? free?.at;
  if (!place) return false;
  if (joint?.fixed) said(`${joint.name} ${joint.fixed}.`);
  else edit({ gesture: "move", at: selected, to: place.map((v, k) => v + by[k] * board.step()), keeps: board.keeps });
  return true;
}

// ---- keys -------------------------------------------------------------------------------------------------------------------------

document.addEventListener("keydown", (event) => {
  if (!open || at("ask").open) return;
  const isTyping = event.target.matches?.("textarea, input:not([type=range]):not([type=radio]):not([type=checkbox])");
  if (event.ctrlKey || event.metaKey) {
    const key = event.key.toLowerCase();
    if (isTyping && key !== "s") return;
        const body = board.selected?.index === undefined && board.selected?.body;
    const run = {
      z: () => step(!event.shiftKey),
      y: () => step(false),
      s: save,
      a: () => board.choose({ all: true }),
      // What is marked as text is copied as text.
      ...(body && getSelection().isCollapsed ? { c: () => ((copied = body), said(`${body} is copied: Ctrl-V`)) } : {}),
      ...(copied ? { v: () => copy(copied) } : {}),
    }[key];
    if (!run) return;
    event.preventDefault();
    run();
    return;
  }
  if (event.altKey) return;
  if (event.key === "Escape") {
    if (play?.timer) play.stop();
    else if (board.pending || board.held) board.let();
    else if (board.tool !== "select") use("select");
    else board.choose(null);
    document.activeElement?.blur?.();
    return;
  }
  if (isTyping || event.target.matches?.("select, button") && event.key === " ") return;
  if (event.target.matches?.("input[type=range]") && ["Home", "Delete", "Backspace"].includes(event.key)) return;
  if (event.key === "Delete" || event.key === "Backspace") {
    if (event.target.closest?.("#inspector, #said, #along, #knobs")) return;
    const { selected } = board;
    if (selected && !selected.all) edit({ gesture: "delete", what: selected }), board.choose(null);
    return;
  }
  if (event.key === "Home") return asDrawn();
  if (event.key === " " && play && open.along && !event.target.matches?.("summary, input:not([type=range])")) {
    event.preventDefault();
    return play.toggle(Number(at("along-path").value));
  }
  const onBoard = [document.body, viewer.svg].includes(event.target);
  if (event.key === "Enter" && onBoard && board.applied()) return event.preventDefault();
  if (ARROWS[event.key] && onBoard && nudged(ARROWS[event.key])) return event.preventDefault();
  if (["bar", "scale"].includes(board.tool) && /^[\d.,-]$/.test(event.key)) {
    at("typed").focus();
    return;
  }
  if (event.key.toLowerCase() === "n" && !event.target.matches?.("select")) return board.next(event.shiftKey ? -1 : 1);
  if (event.key.toLowerCase() === "h" && open.board.planar && !event.target.matches?.("select")) return keep(KEPT.find((one) => one !== board.keeps));
  const tool = !event.target.matches?.("select") && Object.entries(TOOLS).find(([, { key }]) => key === event.key.toLowerCase());
  if (tool && open.board.planar) use(tool[0]);
});

for (const kind of ["pointerdown", "pointerup", "pointercancel"]) {
  document.addEventListener(
    kind,
    (event) => {
      if (kind === "pointerdown") isHeld = event.target.type === "range" || board.held?.moves;
      else {
        isHeld = false;
        settle();
      }
    },
    { capture: true },
  );
}
document.addEventListener("marked", ({ detail }) => {
  if (!detail) return;
  said((placing = detail), true);
  stale(true);
});

const found = await offer();
if (found?.first) await begin({ file: found.first });
else if (found) said("Open a file or an example, or begin with an empty drawing.");
