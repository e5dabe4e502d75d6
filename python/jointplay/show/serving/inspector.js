// The properties of what is chosen, in the words of the file. It shows what the server said of the file and sends edits: places of
// values and what stands there then; `told({ edits })`.

import { digits, parsed, quoted } from "./numbers.js";
import { choice, element, field, marked, texts } from "./sliders.js";
import { whole } from "./whole.js";

/** How the play of a kind of joint can be given. */
const WAYS = {
  revolute: ["none", "radial", "diametral", "fit", "hole and pin", "bearing"],
  fixed: ["none", "radial", "diametral", "fit", "hole and pin"],
  prismatic: ["none", "gap", "fit"],
  pin_in_slot: ["none", "gap", "fit"],
  gear: ["none", "backlash"],
};
const PIN = ["none", "radial", "diametral", "fit", "hole and pin"];
const IN_SPACE = { revolute: PIN, cylindrical: PIN, spherical: PIN, universal: PIN };
/** Kinds whose pins tilt in space, by their length. */
const LONG = ["revolute", "cylindrical", "universal"];
/** How an offset lies in its clearance. */
const LAWS = ["", "normal", "uniform", "boundary"];
const BEARINGS = ["C2", "CN", "C3", "C4", "C5"];

const wayOf = (play) => {
  if (!play) return "none";
  if (play.fit !== undefined) return "fit";
  if (play.hole !== undefined && play.pin !== undefined) return "hole and pin";
  return ["radial", "diametral", "gap", "backlash", "bearing"].find((key) => play[key] !== undefined) ?? "as in the text";
};

export class Inspector {
  constructor(place, { told, chosen, fits, copied }) {
    Object.assign(this, { place, told, chosen, fits, copied });
  }

  /** Shows what is chosen on a board: nothing, a joint, a body, the end of a bar, or all joints. */
  show(board, selected) {
    Object.assign(this, { board, selected });
    const field = this.place.contains(document.activeElement) ? document.activeElement : null;
    // What is half typed is no edit yet; it is shown again when its field is left.
    if (field?.dataset.was !== undefined && field.value !== field.dataset.was) return;
    const fields = () => [...this.place.querySelectorAll("input, select, button")];
    const count = fields().indexOf(field);
    const key = field?.dataset.key || field?.id;
    this.place.replaceChildren();
    this.parts();
    const joint = this.board.joints.find(({ name }) => name === selected?.joint);
    if (selected?.all) this.play(this.board.joints.filter(({ kind, fixed }) => this.waysOf(kind) && !fixed));
    else if (joint) this.joint(joint);
    else if (selected?.body !== undefined) this.body(selected);
    whole(this);
    if (field) (fields().find((one) => key && (one.dataset.key || one.id) === key) ?? fields()[count])?.focus({ preventScroll: true });
  }

  /** All that can be chosen, for those who use no pointer. */
  parts() {
    const label = element("label", { textContent: "chosen " }, this.place);
    const select = element("select", { id: "parts" }, label);
    const add = (text, ref, parent = select) => element("option", { textContent: text, value: JSON.stringify(ref), selected: JSON.stringify(ref) === JSON.stringify(this.selected) }, parent);
    add("nothing", null);
    if (this.board.joints.length > 1) add("all joints (Ctrl-A)", { all: true });
    const group = (words, rows) => {
      const parent = element("optgroup", { label: words }, select);
      for (const [text, ref] of rows) add(text, ref, parent);
    };
    group("joints", this.board.joints.map(({ name, bodies }) => [`${name}: ${bodies.join(", ")}`, { joint: name }]));
    group("bodies", this.board.bodies.map((body) => [body, { body }]));
    group("ends of bars", this.board.free.map(({ body, index }) => [`${body}, point ${index + 1}`, { body, index }]));
    select.addEventListener("input", () => this.chosen(JSON.parse(select.value)));
  }

  waysOf(kind) {
    return (this.board.planar ? WAYS : IN_SPACE)[kind];
  }

  edit(...edits) {
    this.told({ edits });
  }

  send(what) {
    if (what) this.told(what);
  }

  /** A field for a number or an expression; a variable that is named with it comes first. */
  number(parent, options, put) {
    return field(parent, { ...options, names: Object.keys(this.board.variables) }, (value, variable) => {
      const what = put(value);
      if (what) this.told({ ...what, edits: [...(variable ? [[["variables", variable[0]], variable[1]]] : []), ...(what.edits ?? [])] });
    });
  }

  button(words, run, parent = this.place) {
    const made = element("button", { type: "button", textContent: words }, parent);
    made.addEventListener("click", run);
    return made;
  }

  name(kind, name, place = this.place) {
    texts(place, { words: "name", value: name, key: `${kind}.${name}.name` }, (to) => this.told({ rename: [kind, name, to] }));
  }

  joint(joint) {
    element("h2", { textContent: `${joint.name}: ${joint.kind.replaceAll("_", " ")} of ${joint.bodies.join(", ")}` }, this.place);
    if (joint.fixed) return element("p", { textContent: `It ${joint.fixed}; change it in the text.` }, this.place);
    this.name("joint", joint.name);
    if (joint.at && joint.kind !== "gear") this.place2({ joint: joint.name }, joint.written ?? joint.at);
    if (joint.teeth) this.teeth(joint);
    if (this.waysOf(joint.kind)) this.play([joint]);
    if (joint.clearance && joint.kind !== "gear") this.prices(joint.name, joint.clearance);
    if (!this.board.planar) return this.button("delete", () => this.told({ gesture: "delete", what: { joint: joint.name } }));
    const bar = element("div", { className: "bar" }, this.place);
    const act = (words, gesture, more = { at: { joint: joint.name } }) => this.button(words, () => this.told({ gesture, ...more }), bar);
    if (!joint.drive && ["revolute", "prismatic", "pin_in_slot"].includes(joint.kind)) act("drive it", "drive", { joint: joint.name });
    if (joint.kind === "revolute" && !joint.bodies.includes("ground")) act("to the ground", "ground");
    if (["revolute", "fixed"].includes(joint.kind)) act(joint.kind === "fixed" ? "a pin again" : "weld", "weld");
    if (joint.kind === "revolute") act("torsion spring", "spring", { joint: joint.name });
    act("output here", "output");
    act("force on it", "load");
    act(joint.locked ? "unlock" : "lock", "lock");
    return act("delete", "delete", { what: { joint: joint.name } });
  }

  /** Both coordinates of a place, each a number or an expression; all other points stay where they are. */
  place2(at, place) {
    ["x", "y"].forEach((axis, k) => {
      this.number(this.place, { words: axis, value: digits(place[k]), unit: this.board.units.length, key: axis }, (value) => value !== null && { gesture: "move", at, to: place.with(k, value) });
    });
  }

  /** Tooth counts of a gear pair, whose centres stay where they are. */
  teeth({ name, teeth, radii, bodies }) {
    teeth.forEach((count, k) => {
      field(this.place, { words: `teeth of ${bodies[k]}`, value: count, key: `teeth.${k}` }, (value) => value !== null && this.told({ gesture: "teeth", joint: name, teeth: teeth.with(k, value) }));
    });
    if (radii) element("p", { className: "hint", textContent: `Pitch radii ${radii.map(digits).join(" and ")} ${this.board.units.length}.` }, this.place);
  }

  /** What a clearance costs: sizes or fits that can be ordered, with their prices. */
  prices(name, clearance) {
    const way = clearance.fit !== undefined ? "fit" : clearance.bearing !== undefined ? "bearing" : "size";
    const own = this.board.costs[name]?.choices ?? [];
    const value = own.map((one) => `${one[way]}: ${one.cost}`).join("; ");
    const placeholder = { fit: "H7/g6: 24; H8/f7: 15", bearing: "CN: 4; C2: 9", size: "0,02: 24; 0,05: 15" }[way];
    texts(this.place, { words: "prices", value, placeholder, key: `costs.${name}` }, (text, input) => {
      const rows = text.split(";").filter((part) => part.trim()).map((part) => part.split(":").map((word) => word.trim()));
      const choices = rows.map(([what, cost]) => ({ [way]: way === "size" ? parsed(what) : what, cost: parsed(cost ?? "") }));
      const wrong = choices.findIndex((one) => Object.values(one).includes(null));
      marked(input, wrong < 0 ? "" : `prices: ${quoted(rows[wrong].join(": "))} is not a ${way} and its price, such as ${placeholder}`);
      if (wrong < 0) this.edit([["costs", name], choices.length ? { choices } : null]);
    });
  }

  /** The clearance of one joint, or the same of several. */
  play(joints) {
    if (!joints.length) return;
    const box = element("fieldset", { className: "play" }, this.place);
    element("legend", { textContent: joints.length > 1 ? `clearance of ${joints.length} joints` : "clearance" }, box);
    const plays = joints.map(({ clearance }) => clearance ?? null);
    const play = plays.every((one) => JSON.stringify(one) === JSON.stringify(plays[0])) ? plays[0] : null;
    const ways = joints.map(({ kind }) => this.waysOf(kind)).reduce((a, b) => a.filter((way) => b.includes(way)));
    const own = wayOf(play);
    const select = element("select", { id: "way" }, element("label", { textContent: "as " }, box));
    for (const way of ways.includes(own) ? ways : [...ways, own]) element("option", { value: way, textContent: way, selected: way === own }, select);
    const rows = element("div", {}, box);
    const put = (value) => ({ edits: joints.map(({ name }) => [["joints", name, "clearance"], value]) });
    const show = () => {
      rows.replaceChildren();
      this.ways(rows, select.value, select.value === own ? play : rest(play), joints[0].kind, put);
    };
    select.addEventListener("input", () => {
      if (select.value === "none") return this.send(put(null));
      return show();
    });
    show();
  }

  ways(rows, way, play, kind, put) {
    const unit = this.board.units.length;
    const draft = { ...(play ?? {}) };
    const needs = [];
    const row = (words, key, needed = true) => {
      if (needed) needs.push(key);
      this.number(rows, { words, unit, key, value: draft[key] ?? "" }, (value) => {
        if (value === null) delete draft[key];
        else draft[key] = value;
        return ready();
      });
    };
    const ready = () => needs.every((key) => draft[key] !== undefined) && put(draft);
    const law = () => choice(rows, { words: "scatters", value: draft.law ?? "", options: LAWS, key: "law" }, (value) => {
      if (value) draft.law = value;
      else delete draft.law;
      this.send(ready());
    });
    if (["radial", "diametral", "gap", "backlash"].includes(way)) row(way, way);
    if (["radial", "diametral", "gap"].includes(way) && (draft.tolerance === undefined || typeof draft.tolerance !== "object")) row("± tolerance", "tolerance", false);
    if (way === "bearing") {
      needs.push("bearing");
      draft.bearing ??= "CN";
      choice(rows, { words: "group (ISO 5753-1)", value: draft.bearing, options: BEARINGS, key: "bearing" }, (value) => {
        draft.bearing = value;
        this.send(ready());
      });
      row("bore", "bore");
    }
    if (way === "fit") this.fit(rows, draft, kind === "prismatic" || kind === "pin_in_slot" ? "nominal" : "diameter", needs, ready);
    if (way === "hole and pin") this.pair(rows, draft, needs, ready);
    if (kind === "prismatic" && way !== "none") row("length in the guide", "length");
    if (!this.board.planar && LONG.includes(kind) && way !== "none") row("length of the pin", "length");
    if (way !== "as in the text" && way !== "none" && kind !== "gear") law();
    if (way === "as in the text") element("p", { textContent: "It is given in a way that only the text shows." }, rows);
  }

  /** The preferred fits of a diameter, with the play of each. */
  async fit(rows, draft, size, needs, ready) {
    needs.push(size, "fit");
    const label = element("label", { className: "field", textContent: "fit (ISO 286) " });
    const select = element("select", { id: "fit", disabled: true }, label);
    const list = async () => {
      if (draft[size] === undefined) return;
      const found = await this.fits({ diameter: draft[size], fit: draft.fit ?? "" });
      select.replaceChildren(element("option", { value: "", textContent: "…" }));
      for (const [fit, least, most] of found ?? []) {
        element("option", { value: fit, textContent: `${fit}: play ${digits(least)} to ${digits(most)} ${this.board.units.length}`, selected: fit === draft.fit }, select);
      }
      select.disabled = false;
    };
    field(rows, { words: size, unit: this.board.units.length, key: size, value: draft[size] ?? "" }, (value) => {
      if (value === null) delete draft[size];
      else draft[size] = value;
      if (draft.fit) this.send(ready());
      else list();
    });
    rows.append(label);
    select.addEventListener("input", () => {
      if (!select.value) return;
      draft.fit = select.value;
      this.send(ready());
    });
    await list();
  }

  /** Diameters of hole and pin with their limits. */
  pair(rows, draft, needs, ready) {
    needs.push("hole", "pin");
    delete draft.diameter;
    for (const part of ["hole", "pin"]) {
      const own = { plus: 0, minus: 0, ...(draft[part] ?? {}) };
      for (const [words, key] of [["diameter", "diameter"], ["+", "plus"], ["−", "minus"]]) {
        if (own[key] !== undefined && typeof own[key] === "object") continue;
        field(rows, { words: `${part} ${words}`, unit: this.board.units.length, key: `${part}.${key}`, value: own[key] ?? "" }, (value) => {
          if (value === null) delete own[key];
          else own[key] = value;
          if (own.class !== undefined) ["plus", "minus"].forEach((k) => delete own[k]);
          if (own.diameter === undefined) delete draft[part];
          else draft[part] = { ...own };
          this.send(ready());
        });
      }
    }
  }

  body({ body, index }) {
    element("h2", { textContent: index === undefined ? body : `${body}, point ${index + 1}` }, this.place);
    if (index === undefined) this.name("body", body);
    const own = this.board.joints.filter(({ bodies, at }) => bodies.includes(body) && at);
    if (index === undefined && own.length > 1) element("p", { className: "hint", textContent: "Lengths between its joints; the second one moves." }, this.place);
    own.slice(1).forEach((joint, k) => {
      const from = own[k];
      const size = Math.hypot(joint.at[0] - from.at[0], joint.at[1] - from.at[1]);
      if (index === undefined) this.number(this.place, { words: `${from.name} to ${joint.name}`, unit: this.board.units.length, value: digits(size), key: `${from.name} ${joint.name}` }, (value) => value !== null && { gesture: "length", from: from.name, to: joint.name, value });
    });
    if (index === undefined) this.arms(body, own);
    const free = this.board.free.find((one) => one.body === body && one.index === index);
    if (free) this.place2({ body, index }, free.at);
    const bar = element("div", { className: "bar" }, this.place);
    if (free) {
      const words = { ground: "pin to the ground", slider: "slider", slot: "slot", weld: "weld to the ground", output: "output here", load: "force on it" };
      for (const [gesture, text] of Object.entries(words)) this.button(text, () => this.told({ gesture, at: { body, index } }), bar);
    } else if (this.board.planar) this.button("copy", () => this.copied(body), bar);
    this.button("delete", () => this.told({ gesture: "delete", what: index === undefined ? { body } : { body, index } }), bar);
  }

  /** Lengths up to the points of a bar that no joint is at, from its last joint, or from its first point. */
  arms(body, joints) {
    const points = this.board.free.filter((one) => one.body === body).map(({ index, at }) => ({ name: `point ${index + 1}`, index, at }));
    const [from, ...ends] = [...joints.slice(-1), ...points];
    for (const { name, index, at } of ends) {
      const by = at.map((v, k) => v - from.at[k]);
      const size = Math.hypot(...by);
      const to = (value) => this.told({ gesture: "move", at: { body, index }, to: from.at.map((v, k) => v + (by[k] * value) / size) });
      field(this.place, { words: `${from.name} to ${name}`, unit: this.board.units.length, value: digits(size), key: `${from.name} ${name}` }, (value) => value > 0 && to(value));
    }
  }

  /** Marks the field of a key that a message names. */
  blame(key, problem) {
    const fields = [...this.place.querySelectorAll("[data-key]")].filter(({ dataset }) => dataset.key);
    // A value of a list has no field of its own where the list has one.
    const input = [key, key.replace(/\.\d+$/, "")].map((one) => fields.find(({ dataset }) => one.endsWith(dataset.key))).find(Boolean);
    if (input) marked(input, problem);
  }
}

/** What a clearance has beside its size. */
function rest(play) {
  const own = { ...(play ?? {}) };
  for (const key of ["radial", "diametral", "gap", "fit", "hole", "pin", "slot", "slider", "backlash", "tolerance", "size_law", "bearing", "bore", "reduction"]) delete own[key];
  return own;
}
