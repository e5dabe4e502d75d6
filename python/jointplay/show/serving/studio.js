// The page to play with a mechanism. What is shown follows from `asked`, what the sliders and choices say; every change of it has
// a larger serial number. One question is on its way at a time: what changes meanwhile is asked when the answer is there, and only
// the newest. When the sliders rest, the exact answers are asked for, one after the other, until something changes again.

import { view } from "./viewer.js";
import { bars, chart, short } from "./charts.js";

const QUANTITIES = ["position", "rotation"];
const GROUPS = { clearances: "Clearances", tolerances: "Tolerances", loads: "Loads" };
const SLIDER_STEPS = 2000;
// Pixels around the output in which a pointer takes hold of it.
const HOLD = 28;

const at = (id) => document.getElementById(id);
let open = null; // what the server said of the mechanism
let viewer = null;
let asked = {};
let shown = { here: {}, path: {} };
let isAsking = false;
let isHeld = false;
let settling = null;
let openings = 0;

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

async function ask() {
  if (isAsking || !open) return;
  isAsking = true;
  const { page, serial } = asked;
  const found = await trying(() => post("now", asked));
  isAsking = false;
  if (page !== asked.page) return ask();
  if (found && !found.cancelled) show(found);
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
    if (!found || found.cancelled) return;
    show(found);
    next = found.next;
  }
  settling = null;
  mark("exact");
}

// ---- showing ----------------------------------------------------------------------------------------------------------------------

/** What the errors along the path depend on. */
const pathKey = () => JSON.stringify([asked.page, asked.values, asked.output, asked.load_case]);

const isPossible = (question) => open.loads || !open.questions[question].needs_loads;

function mark(state = "rough") {
  document.body.dataset.state = state;
  document.body.dataset.serial = asked.serial;
}

function show(found) {
  if (!found.exact) {
    shown.here = {};
    said(found.problem ?? "", Boolean(found.problem));
  }
  for (const [question, answer] of Object.entries(found.here ?? {})) shown.here[question] = { ...answer, exact: found.exact || !open.questions[question].is_rough };
  if (shown.path.key !== pathKey()) shown.path = { key: pathKey() };
  for (const [question, answer] of Object.entries(found.path ?? {})) {
    // Where only the drives have moved, what is exact along the path stays so.
    if (!found.exact && shown.path[question]?.exact) continue;
    shown.path[question] = { ...answer, exact: found.exact || !open.questions[question].is_rough, samples: found.samples };
  }
  if (found.scene) viewer.update(found.scene);
  document.body.dataset.shown = found.serial;
  document.body.dataset.milliseconds = found.milliseconds;
  answer();
  numbers();
  along();
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

/** The verdict over all questions along the path, the worst outcome first; it says what it rests on. */
function whole(questions) {
  const words = { missed: "✗ Limits missed: ", "not shown": "? Not shown: ", held: "✓ Limits hold " };
  const groups = Object.keys(words).map((state) => [state, questions.map((name) => shown.path[name]).filter((own) => own.outcome === state)]).filter(([, found]) => found.length);
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
      const { value, unit } = own[name];
      const cell = element("td", { textContent: value === null ? "–" : `${short(value)} ${unit}` });
      cell.dataset.value = value;
      return cell;
    });
    row.append(element("th", { textContent: question === "random" ? `${words}, 95 %` : words }), ...values, element("td", { textContent: wordOf(question, own) }));
    return row;
  });
  at("numbers").tBodies[0].replaceChildren(...rows);
}

function along() {
  const questions = Object.keys(open.questions).filter((question) => shown.path[question]);
  const single = open.drives.length === 1;
  const x = open.along.map((row, k) => (single ? row[0] : k));
  const here = single ? asked.drives[0] : open.drives.length ? Number(at("along-path")?.value ?? NaN) : null;
  const charts = QUANTITIES.map((quantity) => {
    const place = document.createElement("div");
    const curves = questions.map((name) => ({ name, values: shown.path[name][quantity].values, exact: shown.path[name].exact }));
    if (curves.length) {
      const { unit, limit } = shown.path[questions[0]][quantity];
      const label = single ? `${open.drives[0].name} [${open.drives[0].unit}]` : "configuration";
      chart(place, { title: quantity, unit, label, x, curves, limit, here: Number.isFinite(here) ? here : null });
    }
    return place;
  });
  at("charts").replaceChildren(...charts);
  const rough = questions.filter((question) => !shown.path[question].exact);
  at("state").textContent = rough.length ? "not yet exact" : questions.length ? "exact" : "";
  at("state").className = rough.length ? "rough" : "";
  const words = questions.flatMap((question) => {
    const own = shown.path[question];
    const head = element("p", { className: `key ${question}`, textContent: `${open.questions[question].words} (${wordOf(question, own)})` });
    return [head, ...own.sentences.slice(0, 3).map(sentence)];
  });
  at("verdict").replaceChildren(...whole(questions), ...words);
}

// ---- sliders ----------------------------------------------------------------------------------------------------------------------

function element(name, properties = {}, parent = null) {
  const made = Object.assign(document.createElement(name), properties);
  parent?.append(made);
  return made;
}

/** A slider with a number beside it; `moved` is called with every new value. */
function slider(parent, { name, words, unit, low, high, value }, moved) {
  const row = element("div", { className: "slider" }, parent);
  row.dataset.name = name;
  const label = element("label", {}, row);
  element("span", { textContent: words }, label);
  const digits = Math.max(0, Math.min(12, Math.ceil(Math.log10(SLIDER_STEPS / (high - low || 1)))));
  const range = element("input", { type: "range", min: low, max: high, step: "any", value }, label);
  const number = element("input", { type: "number", step: "any", value: Number(value.toPrecision(6)) }, row);
  number.setAttribute("aria-label", words);
  element("span", { className: "unit", textContent: unit }, row);
  range.addEventListener("input", () => {
    const next = Number(Number(range.value).toFixed(digits));
    number.value = next;
    moved(next);
  });
  number.addEventListener("input", () => {
    if (number.value === "" || !Number.isFinite(number.valueAsNumber)) return;
    range.value = number.value;
    moved(number.valueAsNumber);
  });
  return (next) => {
    range.value = next;
    number.value = Number(next.toPrecision(6));
  };
}

// What sets the sliders of drives, and of offsets by name.
let drivesTo = [];
let offsetsTo = {};

function moves() {
  const place = at("moves");
  place.replaceChildren();
  drivesTo = [];
  const rows = open.along.filter((row) => row.every((v) => v !== null));
  if (rows.length > 1 && open.drives.length) {
    const label = element("label", { className: "path" }, place);
    element("span", { textContent: "along the path" }, label);
    const range = element("input", { type: "range", id: "along-path", min: 0, max: rows.length - 1, step: "any", value: Math.floor(rows.length / 2) }, label);
    range.addEventListener("input", () => follow(Number(range.value)));
  }
  drivesTo = open.drives.map((drive, k) =>
    slider(place, { ...drive, words: drive.name, value: asked.drives[k] }, (value) => changed({ drives: asked.drives.with(k, value) })),
  );
}

/** Moves the drives to a place along the path, between its configurations as well. */
function follow(place) {
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
    for (const knob of own) slider(box, { ...knob, name: knob.key, words: `${knob.name} ${knob.measure}` }, (value) => changed({ values: { ...asked.values, [knob.key]: value } }));
  }
  const box = element("details", { open: true, id: "offsets", hidden: !open.questions[asked.question].takes_offsets }, place);
  element("summary", { textContent: "Given offsets" }, box);
  const worst = element("button", { type: "button", textContent: "as at the largest position error" }, box);
  worst.addEventListener("click", () => {
    const offsets = shown.here.worst?.offsets;
    if (!offsets) return;
    for (const [name, value] of Object.entries(offsets)) offsetsTo[name]?.(value);
    changed({ offsets });
  });
  offsetsTo = {};
  for (const one of open.offsets) offsetsTo[one.name] = slider(box, { ...one, words: one.name, value: 0 }, (value) => changed({ offsets: { ...asked.offsets, [one.name]: value } }));
  const back = element("button", { type: "button", textContent: "everything as in the file" }, place);
  back.addEventListener("click", () => {
    changed({ values: {}, offsets: {} });
    knobs();
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

// ---- the drawing ------------------------------------------------------------------------------------------------------------------

function drawn() {
  at("drawing").replaceChildren();
  viewer = view(at("drawing"), open.scene, { chosen: true });
  const { svg } = viewer;
  const place = (event) => {
    const box = svg.getBoundingClientRect();
    const scale = svg.viewBox.baseVal.width / box.width;
    return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
  };
  const apart = ([x, y], [u, v]) => Math.hypot(x - u, y - v);
  const path = open.scene.path.filter((point) => point.every((v) => v !== null));
  let dragged = false;
  // Before the viewer, which turns or shifts the drawing.
  svg.addEventListener(
    "pointerdown",
    (event) => {
      const output = viewer.scene.places[0][viewer.scene.output];
      if (path.length < 2 || output.includes(null) || !at("along-path") || apart(place(event), viewer.project(output)) > HOLD) return;
      event.stopImmediatePropagation();
      svg.setPointerCapture(event.pointerId);
      dragged = isHeld = true;
    },
    { capture: true },
  );
  svg.addEventListener("pointermove", (event) => {
    if (dragged) follow(nearest(path.map((point) => viewer.project(point)), place(event)));
  });
  svg.addEventListener("pointerup", () => (dragged = false));
}

/** The place along a line that is nearest to a point, as a number of corners. */
function nearest(line, [x, y]) {
  let best = [Infinity, 0];
  for (let k = 0; k + 1 < line.length; k++) {
    const [[a, b], [c, d]] = [line[k], line[k + 1]];
    const length = (c - a) ** 2 + (d - b) ** 2;
    const part = length ? Math.min(1, Math.max(0, ((x - a) * (c - a) + (y - b) * (d - b)) / length)) : 0;
    const away = Math.hypot(x - a - part * (c - a), y - b - part * (d - b));
    if (away < best[0]) best = [away, k + part];
  }
  return best[1];
}

// ---- files ------------------------------------------------------------------------------------------------------------------------

async function begin(what) {
  said("");
  const mine = ++openings;
  const found = await trying(() => post("open", what));
  if (!found || mine !== openings) return;
  open = found;
  shown = { here: {}, path: {} };
  asked = { page: open.page, serial: 0, values: {}, drives: open.begin, question: Object.keys(open.questions).find(isPossible), offsets: {} };
  document.title = at("title").textContent = open.title || open.name;
  at("name").value = open.file || open.name;
  document.body.classList.add("opened");
  // Every question has the colour of its number.
  Object.keys(open.questions).forEach((name, k) => document.styleSheets[0].insertRule(`.${name} { --own: var(--own-${k}); }`));
  drawn();
  moves();
  choices();
  questions();
  knobs();
  // The size of the errors says how much they are magnified; the worst ones are the largest.
  const first = await trying(() => post("now", { ...asked, question: "worst" }));
  if (mine !== openings) return;
  if (first?.scene) viewer.magnify(first.scene.factor);
  changed({});
}

async function offer() {
  const found = await trying(() => post("choices", {}));
  if (!found) return;
  const select = at("open");
  select.replaceChildren(element("option", { value: "", textContent: "…" }));
  for (const [words, kind, names] of [[found.folder, "file", found.files], ["examples", "example", found.examples.map(({ name }) => name)]]) {
    const group = element("optgroup", { label: words }, select);
    for (const name of names) element("option", { value: JSON.stringify({ [kind]: name }), textContent: name }, group);
  }
  return found;
}

function download(name, kind, text) {
  const link = element("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: kind })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

const stem = () => (at("name").value.replace(/\.toml$/i, "") || "mechanism");

at("open").addEventListener("input", () => {
  if (at("open").value) begin(JSON.parse(at("open").value));
  at("open").selectedIndex = 0;
});
at("upload").addEventListener("change", async () => {
  const [file] = at("upload").files;
  at("upload").value = "";
  if (file) begin({ text: await file.text(), name: file.name });
});
at("save").addEventListener("click", () =>
  trying(async () => {
    const found = await post("save", { ...asked, name: at("name").value });
    await offer();
    at("name").value = found.file;
    said(`saved ${found.file}`);
  }),
);
at("download").addEventListener("click", () => trying(async () => download(`${stem()}.toml`, "application/toml", (await post("text", asked)).text)));
at("report").addEventListener("click", () =>
  trying(async () => {
    said("the report is being made …");
    download(`${stem()}.html`, "text/html", (await post("report", asked)).html);
    said("the report is saved where the browser saves files");
  }),
);
for (const kind of ["pointerdown", "pointerup", "pointercancel"]) {
  document.addEventListener(
    kind,
    (event) => {
      if (kind === "pointerdown") isHeld = event.target.type === "range";
      else {
        isHeld = false;
        settle();
      }
    },
    { capture: true },
  );
}

const found = await offer();
if (found?.first) await begin({ file: found.first });
else if (found) said("Open a file or an example.");
