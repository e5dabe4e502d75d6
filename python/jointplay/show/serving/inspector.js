// The properties of what is chosen, in the words of the file. It shows what the server said of the file and sends edits: places of
// values and what stands there then; `told({ edits })`.

import { digits, element, field, marked } from "./sliders.js";

/** How the play of a kind of joint can be given. */
const WAYS = {
  revolute: ["none", "radial", "diametral", "fit", "hole and pin"],
  fixed: ["none", "radial", "diametral", "fit", "hole and pin"],
  prismatic: ["none", "gap", "fit"],
  pin_in_slot: ["none", "gap", "fit"],
};
const PIN = ["none", "radial", "diametral", "fit", "hole and pin"];
const IN_SPACE = { revolute: PIN, cylindrical: PIN, spherical: PIN, universal: PIN };
/** Kinds whose pins tilt in space, by their length. */
const LONG = ["revolute", "cylindrical", "universal"];
const LIMITS = { position: "length", rotation: "angle", x: "length", y: "length" };
const MORE = [{ angle: "angle" }, { z: "length", rx: "angle", ry: "angle", rz: "angle" }];

const wayOf = (play) => {
  if (!play) return "none";
  if (play.fit !== undefined) return "fit";
  if (play.hole !== undefined && play.pin !== undefined) return "hole and pin";
  return ["radial", "diametral", "gap"].find((key) => play[key] !== undefined) ?? "as in the text";
};

export class Inspector {
  constructor(place, { told, chosen, fits }) {
    Object.assign(this, { place, told, chosen, fits });
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
    this.mechanism();
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

  button(words, run, parent = this.place) {
    const made = element("button", { type: "button", textContent: words }, parent);
    made.addEventListener("click", run);
    return made;
  }

  name(kind, name) {
    const row = element("label", { className: "field" }, this.place);
    element("span", { textContent: "name" }, row);
    const input = element("input", { value: name, spellcheck: false, autocomplete: "off" }, row);
    input.addEventListener("change", () => this.told({ rename: [kind, name, input.value.trim()] }));
  }

  joint(joint) {
    element("h2", { textContent: `${joint.name}: ${joint.kind.replaceAll("_", " ")} of ${joint.bodies.join(", ")}` }, this.place);
    if (joint.fixed) return element("p", { textContent: `It ${joint.fixed}; change it in the text.` }, this.place);
    this.name("joint", joint.name);
    if (joint.at) {
      // The place as it is shown; the other points stay where they are.
      ["x", "y"].forEach((axis, k) => {
        field(this.place, { words: axis, value: digits(joint.at[k]), unit: this.board.units.length, key: axis }, (value) => value !== null && this.told({ gesture: "move", at: { joint: joint.name }, to: joint.at.with(k, value) }));
      });
    }
    if (this.waysOf(joint.kind)) this.play([joint]);
    const bar = element("div", { className: "bar" }, this.place);
    if (!joint.drive && ["revolute", "prismatic", "pin_in_slot"].includes(joint.kind)) this.button("drive it", () => this.told({ gesture: "drive", joint: joint.name }), bar);
    return this.button("delete", () => this.told({ gesture: "delete", what: { joint: joint.name } }), bar);
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
    const put = (value) => this.edit(...joints.map(({ name }) => [["joints", name, "clearance"], value]));
    const show = () => {
      rows.replaceChildren();
      this.ways(rows, select.value, select.value === own ? play : rest(play), joints[0].kind, put);
    };
    select.addEventListener("input", () => {
      if (select.value === "none") return put(null);
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
      field(rows, { words, unit, key, value: draft[key] ?? "" }, (value) => {
        if (value === null) delete draft[key];
        else draft[key] = value;
        ready();
      });
    };
    const ready = () => needs.every((key) => draft[key] !== undefined) && put(draft);
    if (["radial", "diametral", "gap"].includes(way)) row(way, way);
    if (way === "fit") this.fit(rows, draft, kind === "prismatic" || kind === "pin_in_slot" ? "nominal" : "diameter", needs, ready);
    if (way === "hole and pin") this.pair(rows, draft, needs, ready);
    if (kind === "prismatic" && way !== "none") row("length in the guide", "length");
    if (!this.board.planar && LONG.includes(kind) && way !== "none") row("length of the pin", "length");
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
      if (draft.fit) ready();
      else list();
    });
    rows.append(label);
    select.addEventListener("input", () => {
      if (!select.value) return;
      draft.fit = select.value;
      ready();
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
          ready();
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
      if (index === undefined) field(this.place, { words: `${from.name} to ${joint.name}`, unit: this.board.units.length, value: digits(size), key: `${from.name} ${joint.name}` }, (value) => value !== null && this.told({ gesture: "length", from: from.name, to: joint.name, value }));
    });
    const free = this.board.free.find((one) => one.body === body && one.index === index);
    if (free) {
      ["x", "y"].forEach((axis, k) => {
        field(this.place, { words: axis, value: digits(free.at[k]), unit: this.board.units.length, key: axis }, (value) => value !== null && this.told({ gesture: "move", at: { body, index }, to: free.at.with(k, value) }));
      });
    }
    this.button("delete", () => this.told({ gesture: "delete", what: index === undefined ? { body } : { body, index } }));
  }

  /** What is of the whole mechanism: limits, drives, loads. */
  mechanism() {
    const { board } = this;
    const limits = element("details", { open: true, id: "limits" }, this.place);
    element("summary", { textContent: "Limits of the output" }, limits);
    for (const [key, kind] of Object.entries({ ...LIMITS, ...MORE[Number(!board.planar)] })) {
      const value = board.limits[key];
      if (value !== undefined && typeof value === "object") element("p", { textContent: `${key} is ${JSON.stringify(value)}; change it in the text.` }, limits);
      else field(limits, { words: key, unit: board.units[kind], value: value ?? "", key: `limits.${key}` }, (next) => this.edit([["limits", key], next]));
    }
    for (const [name, drive] of Object.entries(board.drives)) {
      const box = element("details", { open: true, className: "drive" }, this.place);
      element("summary", { textContent: `Drive ${name} of ${drive.joint ?? "several joints"}` }, box);
      const turns = board.joints.find((joint) => joint.name === drive.joint)?.kind === "revolute";
      const unit = board.units[turns ? "angle" : "length"];
      if (drive.values !== undefined) element("p", { textContent: `${drive.values.length ?? ""} values, in the text` }, box);
      if (drive.from !== undefined) {
        for (const key of ["from", "to", "count"]) field(box, { words: key, unit: key === "count" ? "" : unit, value: drive[key] ?? "", key: `drives.${name}.${key}` }, (value) => value !== null && this.edit([["drives", name, key], value]));
      }
      if (drive.error === undefined || typeof drive.error !== "object") field(box, { words: "error", unit, value: drive.error ?? "", key: `drives.${name}.error` }, (value) => this.edit([["drives", name, "error"], value]));
      this.button("delete", () => this.told({ gesture: "delete", what: { drive: name } }), box);
    }
    board.loads.forEach((load, k) => {
      const box = element("details", { open: true, className: "load" }, this.place);
      element("summary", { textContent: `Load ${k + 1}${load.body ? ` on ${load.body}` : ""}` }, box);
      if (Array.isArray(load.force) && load.force.every((v) => !Array.isArray(v))) {
        load.force.forEach((value, axis) => field(box, { words: `force ${"xyz"[axis]}`, unit: board.units.force, value, key: `loads.${k}.force.${axis}` }, (next) => next !== null && this.edit([["loads", k, "force", axis], next])));
      }
      this.button("delete", () => this.told({ gesture: "delete", what: { load: k } }), box);
    });
    if (board.output?.body) {
      const box = element("p", { textContent: `Output: ${board.output.body} at ${[board.output.at ?? [0, 0]].flat().join(", ")} ` }, this.place);
      this.button("delete", () => this.told({ gesture: "delete", what: { output: true } }), box);
    }
  }

  /** Marks the field of a key that a message names. */
  blame(key, problem) {
    const input = [...this.place.querySelectorAll("[data-key]")].find(({ dataset }) => dataset.key && key.endsWith(dataset.key));
    if (input) marked(input, problem);
  }
}

/** What a clearance has beside its size. */
function rest(play) {
  const own = { ...(play ?? {}) };
  for (const key of ["radial", "diametral", "gap", "fit", "hole", "pin", "slot", "slider", "tolerance", "size_law", "bearing", "bore", "reduction"]) delete own[key];
  return own;
}
