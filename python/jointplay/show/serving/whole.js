// The properties of the whole mechanism, below those of what is chosen: limits, drives, loads, springs, dimensions, variables.
// A limit is a number for both sides, or `lowest; highest` where the file may have both.

import { choice, element, marked, texts } from "./sliders.js";
import { entered, quoted } from "./numbers.js";
import { MOST_HANDLES } from "./board.js";

const LIMITS = { position: "length", rotation: "angle", x: "length", y: "length" };
/** Those of a size, which has no sides. */
const SIZES = ["position", "rotation"];
/** As many limits of reactions are shown; of more joints those that have one, and the chosen one. */
const MOST = 12;
const MORE = [{ angle: "angle" }, { z: "length", rx: "angle", ry: "angle", rz: "angle" }];
/** How a size scatters between its limits; none is what the file says of its kind. */
const LAWS = ["", "normal", "uniform", "triangular"];

const isTable = (value) => value !== null && typeof value === "object";

export function whole(inspector) {
  const { board } = inspector;
  limits(inspector);
  forces(inspector);
  for (const [name, drive] of Object.entries(board.drives)) driven(inspector, name, drive);
  board.loads.forEach((one) => loaded(inspector, one));
  for (const [name, spring] of Object.entries(board.springs)) sprung(inspector, name, spring);
  for (const [name, own] of Object.entries(board.dimensions)) measured(inspector, name, own);
  variables(inspector);
  if (board.target) wanted(inspector);
  if (board.output?.body) {
    const box = element("p", { textContent: `Output: ${board.output.body} at ${[board.output.at ?? [0, 0]].flat().join(", ")} ` }, inspector.place);
    inspector.button("delete", () => inspector.told({ gesture: "delete", what: { output: true } }), box);
  }
}

function box(inspector, kind, title) {
  const place = element("details", { open: true, className: kind }, inspector.place);
  element("summary", { textContent: title }, place);
  return place;
}

/** A field of a value of the file; what only the text can say is left to it. */
function value(inspector, place, steps, words, own, unit = "", { needed = false, pair = false } = {}) {
  if (isTable(own) && !(pair && Array.isArray(own))) return element("p", { className: "hint", textContent: `${words} is ${JSON.stringify(own)}; change it in the text.` }, place);
  return inspector.number(place, { words, unit, value: Array.isArray(own) ? own.join("; ") : (own ?? ""), key: steps.join("."), pair }, (next) => (next !== null || !needed) && { edits: [[steps, next]] });
}

function law(inspector, place, steps, own) {
  if (isTable(own)) return element("p", { className: "hint", textContent: `It scatters as ${JSON.stringify(own)}; change it in the text.` }, place);
  return choice(place, { words: "scatters", value: own ?? "", options: LAWS, key: steps.join(".") }, (next) => inspector.edit([steps, next || null]));
}

function limits(inspector) {
  const { board } = inspector;
  const place = box(inspector, "limits", "Limits of the output");
  place.id = "limits";
  for (const [key, kind] of Object.entries({ ...LIMITS, ...MORE[Number(!board.planar)] })) value(inspector, place, ["limits", key], key, board.limits[key], board.units[kind], { pair: !SIZES.includes(key) });
}

/** What drives and joints may bear. */
function forces(inspector) {
  const { board, selected } = inspector;
  const { force, length } = board.units;
  const { drive_torques: torques = {}, reactions = {} } = board.limits;
  // Of several bodies on one pin each turns about it in a joint of its own.
  const joints = board.joints.flatMap(({ name, bodies }) => (bodies.length > 2 ? bodies.slice(1).map((body) => [`${name}/${body}`, name]) : [[name, name]]));
  const own = joints.length > MOST ? joints.filter(([name, pin]) => name in reactions || pin === selected?.joint) : joints;
  const drives = Object.entries(board.drives);
  if (!joints.length && !drives.length) return;
  const place = box(inspector, "limits", "Limits of forces");
  for (const [name, drive] of drives) {
    const [words, unit] = turns(board, drive) ? ["moment", `${force} ${length}`] : ["force", force];
    value(inspector, place, ["limits", "drive_torques", name], `${words} of ${name}`, torques[name], unit, { pair: true });
  }
  for (const [name] of own) value(inspector, place, ["limits", "reactions", name], `reaction at ${name}`, reactions[name], force);
  if (own.length < joints.length) element("p", { className: "hint", textContent: "Choose a joint for a limit of its reaction." }, place);
}

/** Whether what a drive moves turns. */
function turns(board, { joint, joints = {} }) {
  const pin = (joint ?? Object.keys(joints)[0])?.split("/")[0];
  return board.joints.find(({ name }) => name === pin)?.kind === "revolute";
}

function driven(inspector, name, drive) {
  const { board } = inspector;
  const place = box(inspector, "drive", `Drive ${name} of ${drive.joint ?? "several joints"}`);
  inspector.name("drive", name, place);
  const unit = board.units[turns(board, drive) ? "angle" : "length"];
  const steps = (key) => ["drives", name, key];
  if (Array.isArray(drive.values)) {
    texts(place, { words: "values", unit, value: drive.values.join("; "), key: `drives.${name}.values` }, (text, input) => {
      const found = text.split(";").filter((part) => part.trim()).map((part) => entered(part, { unit, names: Object.keys(board.variables) }));
      const wrong = !found.length || found.some(({ problem, variable }) => problem || variable);
      marked(input, wrong ? `values: ${quoted(text)} are not numbers with ; between them` : "");
      if (!wrong) inspector.edit([steps("values"), found.map(({ value: one }) => one)]);
    });
    if (drive.values.length > MOST_HANDLES) element("p", { className: "hint", textContent: `On the drawing more than ${MOST_HANDLES} values have ticks, and no handles.` }, place);
  }
  if (drive.from !== undefined) for (const key of ["from", "to", "count"]) value(inspector, place, steps(key), key, drive[key], key === "count" ? "" : unit, { needed: true });
  value(inspector, place, steps("error"), "error", drive.error, unit);
  if (drive.error) law(inspector, place, steps("law"), drive.law);
  value(inspector, place, steps("backlash"), "backlash", drive.backlash, unit);
  inspector.button("delete", () => inspector.told({ gesture: "delete", what: { drive: name } }), place);
}

function loaded(inspector, { at, case: own, load }) {
  const { board } = inspector;
  const k = at.at(-1);
  const place = box(inspector, "load", `Load ${k + 1}${own ? ` of ${own}` : ""}${load.body ? ` on ${load.body}` : ""}`);
  if (Array.isArray(load.force) && load.force.every((v) => !Array.isArray(v))) {
    load.force.forEach((force, axis) => value(inspector, place, [...at, "force", axis], `force ${"xyz"[axis]}`, force, board.units.force, { needed: true }));
  }
  if (board.planar) value(inspector, place, [...at, "moment"], "moment", load.moment, `${board.units.force ?? ""} ${board.units.length ?? ""}`);
  const input = texts(place, { words: "load case", value: own, placeholder: "in all cases", key: `${at.join(".")}.case` }, (to) => inspector.told({ gesture: "case", load: k, from: own, to }));
  input.setAttribute("list", "cases");
  inspector.button("delete", () => inspector.told({ gesture: "delete", what: { load: k, case: own } }), place);
  const known = document.getElementById("cases") ?? element("datalist", { id: "cases" }, document.body);
  known.replaceChildren(...Object.keys(board.load_cases).map((name) => element("option", { value: name })));
}

function sprung(inspector, name, spring) {
  const { units } = inspector.board;
  const place = box(inspector, "spring", `Spring ${name} ${spring.joint ? `about ${spring.joint}` : `of ${Object.keys(spring.on ?? {}).join(" and ")}`}`);
  inspector.name("spring", name, place);
  const [size, unit] = spring.joint ? ["free_angle", units.angle] : ["free_length", units.length];
  const force = spring.joint ? `${units.force} ${units.length}` : units.force;
  value(inspector, place, ["springs", name, "stiffness"], "stiffness", spring.stiffness, `${force}/${unit}`, { needed: true });
  value(inspector, place, ["springs", name, size], size.replace("_", " "), spring[size], unit, { needed: !spring.joint });
  value(inspector, place, ["springs", name, "preload"], "preload", spring.preload, force);
  inspector.button("delete", () => inspector.told({ gesture: "delete", what: { spring: name } }), place);
}

function measured(inspector, name, own) {
  const { board } = inspector;
  const place = box(inspector, "dimension", `Dimension ${name} of ${own.body}: ${(own.between ?? []).join(" to ")}`);
  inspector.name("dimension", name, place);
  const steps = (key) => ["dimensions", name, key];
  value(inspector, place, steps("tolerance"), "± tolerance", own.tolerance, board.units.length);
  law(inspector, place, steps("law"), own.law);
  value(inspector, place, steps("deviation"), "deviation", own.deviation, board.units.length);
  inspector.button("delete", () => inspector.told({ gesture: "delete", what: { dimension: name } }), place);
}

/** What the output ought to do; its places, and how far it may be from them. */
function wanted(inspector) {
  const { board } = inspector;
  const { tolerance, ...kinds } = board.target;
  const kind = Object.keys(kinds).find((key) => key !== "timed") ?? "";
  const place = box(inspector, "target", `Target of the output: ${kind}`);
  const steps = (...more) => ["target", kind, ...more];
  const own = isTable(kinds[kind]) && !Array.isArray(kinds[kind]) ? kinds[kind] : {};
  for (const key of ["through", "to", "centre"]) (Array.isArray(own[key]) ? own[key] : []).forEach((v, axis) => value(inspector, place, steps(key, axis), `${key} ${"xyz"[axis]}`, v, board.units.length, { needed: true }));
  if (own.radius !== undefined) value(inspector, place, steps("radius"), "radius", own.radius, board.units.length, { needed: true });
  value(inspector, place, ["target", "tolerance"], "tolerance", tolerance, ["function", "dwell"].includes(kind) ? "" : board.units.length);
  inspector.button("delete", () => inspector.told({ gesture: "delete", what: { target: true } }), place);
}

/** Names for numbers, which every field takes. */
function variables(inspector) {
  const { board } = inspector;
  const place = box(inspector, "variables", "Variables");
  for (const [name, own] of Object.entries(board.variables)) value(inspector, place, ["variables", name], name, own, "", { needed: true });
  texts(place, { words: "a new one", placeholder: "crank = 40", key: "variables" }, (text, input) => {
    const { variable, problem } = entered(text, { names: Object.keys(board.variables) });
    marked(input, variable || !text ? "" : `a new variable: ${problem ?? `${quoted(text)} is not a name and its value, such as crank = 40`}`);
    if (variable) inspector.edit([["variables", variable[0]], variable[1]]);
  });
}
