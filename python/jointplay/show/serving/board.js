// The drawing as a board: tools that draw and take hold of things. It knows the mechanism only as the server has drawn it, and says
// what a person does as gestures: `told({ gesture, ... })`. In space things can be chosen and nothing drawn.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 800;
// Pixels of the drawing around a point, and around a line, in which a pointer takes hold of it.
const NEAR = 14, LINE = 7;
// Pixels that a pointer may move in a click, and within which a line becomes horizontal or vertical.
const STILL = 6, LEVEL = 7;
// Pixels from a pin to the arc that its drive goes through, at least and at most, and between handles on it where there is room.
const ARC = 46, WIDEST = 120, APART = 10;
// Pixels to both sides of a tick.
const TICK = 5;
// Values of a list up to which each has a handle.
export const MOST_HANDLES = 24;
// Pixels by which a bar is as long as another one.
const ALIKE = 4;
// Pixels that a step of the grid has at least.
const GRID = 9;

export const TOOLS = {
  select: { key: "v", words: "select", hint: "Click chooses; drag a joint to edit the drawing, Shift-drag to move the mechanism and change nothing. N chooses the next thing, arrows move it by a step of the grid. H chooses whether a drag keeps positions or lengths. Drag elsewhere shifts the view, Ctrl and the wheel zoom, a double click starts again.", spatial: "Click chooses, Shift-drag moves the mechanism along its path and changes nothing. N chooses the next thing. Drag elsewhere turns the view, Ctrl and the wheel zoom, a double click starts again." },
  move: { key: "m", words: "move", hint: "Drag the mechanism along its path. The file does not change." },
  bar: { key: "b", words: "bar", hint: "Click both ends, or drag. Ends join where they touch a joint, the end of a bar, or a bar. Type 0;0 where it begins, then 30<45 (length and angle) or 30;40. Alt does not snap." },
  point: { key: "p", words: "point", hint: "Click on a bar: a point of it, for a pin, the output or a load." },
  ground: { key: "g", words: "ground", hint: "Click on a joint or on a point: a pin to the ground." },
  slider: { key: "s", words: "slider", hint: "Click on a joint or on a point, or drag in the direction of the guide: a block in a guide of the ground." },
  slot: { key: "t", words: "slot", hint: "Click on a point, or drag in the direction of the slot: a slot of the ground in which it slides." },
  weld: { key: "w", words: "weld", hint: "Click on a pin of two bodies: they are welded there, and a pin again with another click. A point is welded to the ground." },
  gear: { key: "e", words: "gear pair", hint: "Click on two pins: wheels about them mesh. The properties have their teeth." },
  spring: { key: "c", words: "spring", hint: "Click on both ends: joints, points, bars, or places of the ground." },
  drive: { key: "d", words: "drive", hint: "Click on the joint that is driven." },
  output: { key: "o", words: "output", hint: "Click on the joint or the point whose error matters." },
  load: { key: "f", words: "force", hint: "Click on a joint or a point: a force on it, which the properties change." },
  dimension: { key: "i", words: "dimension", hint: "Click on two joints: their distance is shown, and has a tolerance if one body has both." },
  line: { key: "j", words: "target line", hint: "Click on two places: the output ought to be on the line through them." },
  circle: { key: "r", words: "target circle", hint: "Click on the centre and on a place of the circle on which the output ought to be." },
  lock: { key: "l", words: "lock", hint: "Click on a joint: it stays where it is, until another click." },
  scale: { key: "k", words: "scale picture", hint: "Click on two points of the picture, then type their distance.", hidden: true },
};
/** Tools that take two places. */
const TWO = ["bar", "gear", "spring", "dimension", "line", "circle", "scale"];

export class Board {
  constructor({ told, chosen, followed, said, scaled }) {
    Object.assign(this, { told, chosen, followed, said, scaled, tool: "select", keeps: "positions", selected: null, pending: null });
  }

  /** Another drawing of the viewer; `board` is what the server said of it. */
  on(viewer, board, path) {
    // A bar that was begun meanwhile goes on from where it was begun.
    const from = this.pending && this.placeOf(this.pending);
    Object.assign(this, { viewer, board, path, pending: null });
    const { svg } = viewer;
    viewer.after = () => this.mark();
    this.backdrop = svg.insertBefore(document.createElementNS(SVG, "g"), svg.firstChild);
    this.layer = svg.appendChild(document.createElementNS(SVG, "g"));
    this.grid = svg.insertBefore(document.createElementNS(SVG, "g"), this.backdrop.nextSibling);
    const handle = (kind, run) => svg.addEventListener(kind, (event) => run.call(this, event), { capture: true });
    handle("pointerdown", this.down);
    handle("pointermove", this.moved);
    handle("pointerup", this.up);
    handle("pointercancel", this.let);
    this.use(this.tool);
    if (from && TWO.includes(this.tool)) this.pending = this.hit(this.viewer.project(from)) ?? { at: from };
  }

  use(tool) {
    const { pending } = this;
    this.let();
    if (tool === this.tool) this.pending = pending;
    this.tool = tool;
    this.viewer.plain = !["select", "move"].includes(tool);
    this.viewer.draw();
    this.mark();
  }

  /** Gives up what is half done. */
  let() {
    Object.assign(this, { pending: null, held: null, first: false });
    if (this.viewer.plain && ["select", "move"].includes(this.tool)) this.viewer.plain = false;
    this.layer.replaceChildren();
    this.mark();
  }

  // ---- places ---------------------------------------------------------------------------------------------------------------------

  pixel(event) {
    const box = this.viewer.svg.getBoundingClientRect();
    const scale = WIDTH / box.width;
    return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
  }

  /** Where something chosen or taken hold of is, in pixels. */
  spot(ref) {
    if (ref.joint !== undefined) {
      const point = this.board.joints.find(({ name }) => name === ref.joint)?.point;
      return point == null ? null : this.project(point);
    }
    const free = this.free()[this.board.free.findIndex(({ body, index }) => body === ref.body && index === ref.index)];
    return free === undefined ? null : this.project(free);
  }

  project(point) {
    const place = this.viewer.seen[point];
    return place && place.every((v) => v !== null) ? this.viewer.project(place) : null;
  }

  free() {
    return this.viewer.scene.shapes.filter(({ kind }) => kind === "free").map(({ points }) => points[0]);
  }

  /** What is at a pixel: a joint, a free point, or a point of a body. */
  hit(pixel) {
    const refs = [...this.board.joints.map(({ name }) => ({ joint: name })), ...this.board.free.map(({ body, index }) => ({ body, index }))];
    const near = refs.map((ref) => [ref, this.spot(ref)]).filter(([, at]) => at).map(([ref, at]) => [apart(at, pixel), ref]);
    const best = near.reduce((a, b) => (b[0] < a[0] ? b : a), [Infinity, null]);
    if (best[0] <= NEAR) return best[1];
    let found = [LINE, null];
    for (const { kind, name, points, ground } of this.viewer.scene.shapes) {
      if (kind !== "body" || ground) continue;
      const seen = points.map((k) => this.project(k));
      seen.forEach((from, k) => {
        const to = seen[(k + 1) % seen.length];
        if (!from || !to) return;
        const middle = [0, 1].map((k) => (from[k] + to[k]) / 2);
        const at = apart(middle, pixel) < LINE ? middle : nearest(from, to, pixel);
        if (apart(at, pixel) < found[0]) found = [apart(at, pixel), { body: name, at: this.viewer.unproject(at) }];
      });
    }
    return found[1];
  }

  /** A place that snaps to the grid, to horizontal and vertical from another one, and to lengths that bars have. */
  snapped(pixel, { from = null, free = false } = {}) {
    this.alike = "";
    this.square = null;
    const place = this.viewer.unproject(pixel);
    if (free) return place.map(rounded);
    const step = this.step();
    const found = place.map((v) => Math.round(v / step) * step);
    const beside = from && this.viewer.project(from);
    if (!beside) return found.map(rounded);
    const level = [0, 1].map((k) => Math.abs(pixel[k] - beside[k]) < LEVEL);
    level.forEach((is, k) => is && (found[k] = from[k]));
    if (!level.includes(true)) this.turned(place, from, found);
    const [along, length] = [level.includes(true) || this.square !== null ? found : place, apart(place, from)];
    const alike = this.lengths().find(([, size]) => Math.abs(size - length) * this.viewer.scale * this.viewer.camera.zoom < ALIKE);
    if (!alike || !apart(along, from)) return found.map(rounded);
    this.alike = alike[0];
    return [0, 1].map((k) => rounded(from[k] + ((along[k] - from[k]) * alike[1]) / apart(along, from)));
  }

  /** Turns a place to a multiple of 15 degrees, or to a right angle with a bar that is at the other end. */
  turned(place, from, found) {
    const [dx, dy] = [0, 1].map((k) => place[k] - from[k]);
    const angles = [...Array(24).keys()].map((k) => [(k * Math.PI) / 12, ""]);
    for (const { name, points } of this.bars()) {
      const ends = points.map((k) => this.viewer.seen[k]);
      const seen = ends.map((end) => this.viewer.project(end));
      const at = this.viewer.project(from);
      const angle = Math.atan2(ends[1][1] - ends[0][1], ends[1][0] - ends[0][0]);
      if (apart(nearest(...seen, at), at) < 1) angles.push(...[1, -1].map((side) => [angle + (side * Math.PI) / 2, name]));
    }
    const off = ([angle]) => (dx * Math.cos(angle) + dy * Math.sin(angle) > 0 ? Math.abs(dy * Math.cos(angle) - dx * Math.sin(angle)) : Infinity);
    const best = angles.reduce((a, b) => (off(b) < off(a) ? b : a));
    if (off(best) * this.viewer.scale * this.viewer.camera.zoom >= LEVEL) return;
    const [angle, name] = best;
    this.square = name;
    const unit = [Math.cos(angle), Math.sin(angle)];
    // A place of the grid in this direction remains; else the length is one of the grid.
    const [x, y] = [0, 1].map((k) => found[k] - from[k]);
    if (Math.abs(x * unit[1] - y * unit[0]) <= 1e-9 * Math.hypot(x, y)) return;
    const size = Math.max(1, Math.round((dx * unit[0] + dy * unit[1]) / this.step())) * this.step();
    unit.forEach((v, k) => (found[k] = from[k] + size * v));
  }

  bars() {
    return this.viewer.scene.shapes.filter(({ kind, points, ground }) => kind === "body" && points.length === 2 && !ground);
  }

  /** The bars of two points, and how long they are as they are shown. */
  lengths() {
    return this.bars().map(({ name, points }) => [name, apart(...points.map((k) => this.viewer.seen[k]))]).filter(([, size]) => size > 0);
  }

  step() {
    const least = GRID / (this.viewer.scale * this.viewer.camera.zoom);
    const power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((f) => f * power).find((s) => s >= least);
  }

  /** What a click would take: something that is there, or a place. */
  ref(event, options = {}) {
    const pixel = this.pixel(event);
    return (!event.altKey && this.hit(pixel)) || { at: this.snapped(pixel, { ...options, free: event.altKey }) };
  }

  placeOf(ref) {
    if (ref.at) return ref.at;
    const spot = this.spot(ref);
    return spot && this.viewer.unproject(spot);
  }

  // ---- pointers -------------------------------------------------------------------------------------------------------------------

  down(event) {
    if (event.button || !this.viewer) return;
    const pixel = this.pixel(event);
    const ref = this.hit(pixel);
    const ends = this.tool === "select" && !event.shiftKey ? this.ranges().flatMap(({ ends }) => ends) : [];
    const range = ends.filter(({ at }) => apart(at, pixel) <= NEAR / 2).sort((a, b) => apart(a.at, pixel) - apart(b.at, pixel))[0];
    if (range) {
      event.stopImmediatePropagation();
      this.viewer.svg.setPointerCapture(event.pointerId);
      this.held = { range, pixel, still: true, value: range.value };
      return;
    }
    if (this.tool === "select" || this.tool === "move") {
      const moves = this.tool === "move" || event.shiftKey;
      if (!ref) return moves ? null : this.choose(null);
      event.stopImmediatePropagation();
      this.viewer.svg.focus({ preventScroll: true });
      this.viewer.svg.setPointerCapture(event.pointerId);
      if (!moves) this.choose(ref.at ? { body: ref.body } : ref);
      this.held = { ref, pixel, moves, still: true };
      return;
    }
    event.stopImmediatePropagation();
    event.preventDefault();
    this.viewer.svg.focus({ preventScroll: true });
    this.viewer.svg.setPointerCapture(event.pointerId);
    this.held = { ref: ref ?? this.ref(event), pixel, still: true };
    if (TWO.includes(this.tool) && !this.pending) this.pending = this.ref(event);
  }

  moved(event) {
    const { held, pending } = this;
    const pixel = this.pixel(event);
    if (held && apart(pixel, held.pixel) > STILL) held.still = false;
    if (held?.range) {
      event.stopImmediatePropagation();
      return this.reach(held, pixel, event.altKey);
    }
    if (held?.moves) {
      event.stopImmediatePropagation();
      return this.follow(held.ref, pixel);
    }
    if (held && (this.tool === "select") && !held.still && !held.ref.at) {
      event.stopImmediatePropagation();
      return this.drag(held, event);
    }
    if (this.viewer.plain) this.line(event, pending);
  }

  up(event) {
    const { held } = this;
    this.held = null;
    if (!held) return;
    event.stopImmediatePropagation();
    if (held.range) {
      const { drive, steps, value } = held.range;
      this.let();
      if (held.value !== value) this.told({ edits: [[["drives", drive, ...steps], held.value]] });
      return;
    }
    const ref = this.ref(event, { from: this.pending && this.placeOf(this.pending) });
    if (held.moves) return;
    if (this.tool === "select") {
      if (!held.still && held.to) this.told({ gesture: "move", at: held.ref, to: held.to, keeps: this.keeps });
      this.viewer.plain = false;
      return this.let();
    }
    if (TWO.includes(this.tool)) {
      // The first click is held until the second; a drag is both.
      if (this.first || !held.still) return this.finish(ref);
      this.first = true;
      return;
    }
    const [dx, dy] = [0, 1].map((k) => this.pixel(event)[k] - held.pixel[k]);
    const angle = held.still ? 0 : Math.round((Math.atan2(-dy, dx) * 180) / Math.PI / 15) * 15;
    this.act(held.ref, angle);
  }

  /** What a tool of one click does. */
  act(at, angle = 0) {
    if (this.tool === "drive") {
      if (at.joint === undefined) return this.said("Click on a joint to drive it.");
      return this.told({ gesture: "drive", joint: at.joint });
    }
    if (this.tool === "lock" && at.joint === undefined) return this.said("Click on a joint to lock it.");
    return this.told({ gesture: this.tool, at, ...(["slider", "slot"].includes(this.tool) ? { angle } : {}) });
  }

  /** The tool for what is chosen, by keys. */
  applied() {
    const { selected } = this;
    if (!selected || selected.all || ["select", "move", "scale"].includes(this.tool)) return false;
    if (!TWO.includes(this.tool)) this.act(selected);
    else if (this.pending) this.finish(selected);
    else this.begin(selected);
    return true;
  }

  /** The first of two places. */
  begin(ref) {
    this.pending = ref;
    this.first = true;
    this.mark();
    this.said(`${this.tool} from ${ref.joint ?? ref.body ?? ref.at.join("; ")} …`);
  }

  /** The second of two places. */
  finish(to) {
    const from = this.pending;
    if (this.tool === "scale") {
      this.let();
      return this.scaled([this.placeOf(from), this.placeOf(to)]);
    }
    const ends = [from, to].map((ref) => this.placeOf(ref));
    this.let();
    if (this.tool === "dimension" && ends.every(Boolean)) {
      const bodies = [from, to].map(({ joint }) => this.board.joints.find(({ name }) => name === joint)?.bodies ?? []);
      if (!bodies[0].some((body) => bodies[1].includes(body))) return this.said(`${from.joint ?? "here"} to ${to.joint ?? "here"}: ${this.distance(...ends)}`);
    }
    return this.told({ gesture: this.tool, from, to });
  }

  /** Length and angle from one place to another one. */
  distance(from, to) {
    const [dx, dy] = [0, 1].map((k) => to[k] - from[k]);
    return `${Number(Math.hypot(dx, dy).toPrecision(5))} < ${Number(((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(2))}°`;
  }

  /** An end as it is typed: `0;0` where a bar begins, then `30<45`, length and angle in degrees, or `30;40`, to the right and up. */
  typed(text, parsed) {
    const polar = text.includes("<");
    const [a, b] = text.split(polar ? "<" : ";").map(parsed);
    const from = this.pending && this.placeOf(this.pending);
    if (a === null || b == null || (!from && polar)) return false;
    if (!from) {
      const ref = this.hit(this.viewer.project([a, b]));
      this.begin(ref && apart(this.placeOf(ref), [a, b]) <= 1e-6 * Math.hypot(a, b, 1e-9) ? ref : { at: [a, b] });
      return true;
    }
    const turn = (b * Math.PI) / 180;
    const by = polar ? [a * Math.cos(turn), a * Math.sin(turn)] : [a, b];
    const at = from.map((v, k) => rounded(v + by[k]));
    const ref = this.hit(this.viewer.project(at));
    // What stands exactly there is joined.
    this.finish(ref && apart(this.placeOf(ref), at) <= 1e-6 * Math.hypot(...at, 1e-9) ? ref : { at });
    return true;
  }

  follow(ref, pixel) {
    const point = ref.at ? null : this.board.joints.find(({ name }) => name === ref.joint)?.point;
    const shape = ref.at && this.viewer.scene.shapes.find(({ kind, name }) => kind === "body" && name === ref.body);
    const index = point ?? shape?.points[0] ?? this.viewer.scene.output;
    const line = this.path.map((places) => places[index]).filter((place) => place?.every((v) => v !== null));
    if (line.length < 2) return this.said("Nothing moves yet: what is missing for a path stands below the drawing.");
    this.followed(nearestOn(line.map((place) => this.viewer.project(place)), pixel));
    this.said("The mechanism moves along its path; the file does not change.");
    return null;
  }

  drag(held, event) {
    const joint = this.board.joints.find(({ name }) => name === held.ref.joint);
    if (joint?.fixed) return this.said(`${joint.name} ${joint.fixed}.`);
    if (!this.board.planar) return null;
    this.viewer.plain = true;
    held.to = this.snapped(this.pixel(event), { free: event.altKey });
    if (joint && this.keeps === "lengths") return this.turn(joint, held);
    const seen = this.viewer.project(held.to);
    // What is kept: all other points stay where they are.
    const kept = this.viewer.scene.shapes.filter(({ kind, points, ground }) => kind === "body" && !ground && points.some((k) => apart(this.project(k) ?? [Infinity, 0], this.spot(held.ref)) < 1));
    this.layer.replaceChildren(
      ...kept.flatMap(({ points }) => points.map((k) => this.project(k)).filter((at) => at && apart(at, this.spot(held.ref)) >= 1).map((at) => stroke([at, seen], "b-new"))),
      ring(seen, 7, "b-new"),
    );
    this.said(`${held.ref.joint ?? held.ref.body} to ${held.to.join(", ")} ${this.board.units.length ?? ""}: all other points stay where they are, lengths change.`);
    return null;
  }

  /** A drag that keeps the lengths of the bars on a joint: what stays has a box. The server says where the others go. */
  turn(joint, held) {
    const here = this.spot(held.ref);
    const far = this.board.joints.map((one) => ({ ...one, spot: this.spot({ joint: one.name }) })).filter(({ spot }) => spot && apart(spot, here) >= 1);
    const along = far.filter(({ bodies }) => bodies.some((body) => body !== "ground" && joint.bodies.includes(body)));
    const stays = ({ locked, bodies, kind }) => locked || (bodies.includes("ground") && ["revolute", "fixed"].includes(kind));
    const centres = along.filter(stays);
    let seen = this.viewer.project(held.to);
    for (const { spot } of centres.slice(0, 1)) seen = spot.map((v, k) => v + ((seen[k] - v) * apart(spot, here)) / (apart(spot, seen) || 1));
    this.layer.replaceChildren(
      ...far.filter((one) => !along.includes(one) || stays(one)).map(({ spot }) => box(spot, 8, "b-new b-stays")),
      ...centres.map(({ spot }) => stroke([spot, seen], "b-new")),
      ring(seen, 7, "b-new"),
    );
    const gone = along.filter((one) => !stays(one)).map(({ name }) => name);
    this.said(`${joint.name}: the bars on it keep their lengths${gone.length ? `, ${gone.join(", ")} goes along` : ""}; what has a box stays.`);
    return null;
  }

  line(event, pending) {
    const from = pending && this.placeOf(pending);
    const ref = this.ref(event, { from });
    const to = this.placeOf(ref);
    if (!to) return;
    const seen = this.viewer.project(to);
    const marks = [ring(seen, ref.joint !== undefined || ref.body !== undefined ? 9 : 3, "b-new")];
    if (from) {
      marks.push(stroke([this.viewer.project(from), seen], "b-new"));
      marks.push(words(seen, this.distance(from, to) + (ref.at && !ref.body ? `${this.alike && ` = ${this.alike}`}${this.square ? ` ⊥ ${this.square}` : ""}` : "")));
    }
    this.layer.replaceChildren(...marks);
  }

  // ---- ranges of drives ---------------------------------------------------------------------------------------------------------------

  /** What drives are commanded, where it is in the drawing, on an arc or on a line: a handle at each end or value that is a number. */
  ranges() {
    const found = [];
    for (const [k, name] of (this.driven ?? []).entries()) {
      const { joint: pin, from, to, values } = this.board.drives[name] ?? {};
      const joint = this.board.joints.find((one) => one.name === pin);
      const every = Array.isArray(values) ? values.map((value, n) => [["values", n], value, `value ${n + 1}`]) : [[["from"], from, "from"], [["to"], to, "to"]];
      const known = every.filter(([, value]) => typeof value === "number");
      if (!known.length || (!values && known.length < 2) || !joint?.at || joint.bodies.length !== 2) continue;
      const [low, high] = [Math.min, Math.max].map((end) => end(...known.map(([, value]) => value)));
      const place = joint.axis ? this.slide(joint) : joint.kind === "revolute" ? this.swing(joint, this.now[k], (high - low) / (known.length - 1 || 1)) : null;
      if (!place) continue;
      const isLong = every.length > MOST_HANDLES;
      const [size, ends] = [values ? 4 : 5, []];
      for (const [steps, value, text] of isLong ? [] : known) {
        // After a whole turn a handle would hide the one before: it stands outside of that.
        let off = 0;
        while (ends.some(({ at }) => apart(at, place.at(value, off)) < size)) off += APART;
        ends.push({ drive: name, steps, words: `${name} ${text}`, value, at: place.at(value, off), read: place.read });
      }
      // What turns more than once goes over the same arc.
      const far = Math.min(high - low, place.round ?? Infinity);
      const line = [...Array(65).keys()].map((n) => place.at(low + (far * n) / 64));
      found.push({ ends, lines: [line, ...(isLong ? known : []).map(([, value]) => [-TICK, TICK].map((off) => place.at(value, off)))], size });
    }
    return found.filter(({ lines }) => lines.flat(2).every(Number.isFinite));
  }

  /** Where the coordinate of a guide or slot is, and what it is at a pixel. */
  slide({ at, axis }) {
    return {
      at: (value, off = 0) => {
        const [x, y] = this.viewer.project(at.map((v, k) => v + value * axis[k]));
        return [x + off * axis[1], y + off * axis[0]];
      },
      read: (pixel, _near, free) => {
        const there = this.viewer.unproject(pixel);
        const value = at.reduce((sum, v, k) => sum + (there[k] - v) * axis[k], 0);
        return rounded(free ? value : Math.round(value / this.step()) * this.step());
      },
    };
  }

  /** Where a bar points at the angles of its pin, and what the angle is where it points at a pixel; the arc is wide where values are near. */
  swing({ name, bodies }, now, apartBy) {
    const middle = this.spot({ joint: name });
    const others = [...this.board.joints.filter((one) => one.name !== name && one.bodies.includes(bodies[1])).map(({ name: joint }) => ({ joint })), ...this.board.free.filter(({ body }) => body === bodies[1])];
    const end = middle && others.map((ref) => this.spot(ref)).find((spot) => spot && apart(spot, middle) > 1);
    if (!end) return null;
    const unit = this.board.units.angle === "rad" ? 1 : Math.PI / 180;
    const direction = Math.atan2(middle[1] - end[1], end[0] - middle[0]);
    const round = (2 * Math.PI) / unit;
    const wide = Math.min(Math.max(APART / (Math.abs(apartBy) * unit || Infinity), ARC), WIDEST);
    return {
      round,
      at: (value, off = 0) => [middle[0] + (wide + off) * Math.cos(direction + (value - now) * unit), middle[1] - (wide + off) * Math.sin(direction + (value - now) * unit)],
      read: ([x, y], near, free) => {
        const value = now + (Math.atan2(middle[1] - y, x - middle[0]) - direction) / unit;
        // Of all turns the one that is nearest to where the handle was.
        const own = value + Math.round((near - value) / round) * round;
        const step = free ? 0 : unit === 1 ? 0.01 : 1;
        return rounded(step ? Math.round(own / step) * step : own);
      },
    };
  }

  reach(held, pixel, free) {
    held.value = held.range.read(pixel, held.value, free);
    this.layer.replaceChildren(ring(pixel, 6, "b-new"));
    this.said(`${held.range.words} ${held.value}`);
  }

  // ---- what is chosen ---------------------------------------------------------------------------------------------------------------

  choose(ref) {
    this.selected = ref;
    this.mark();
    this.chosen(ref);
  }

  /** Chooses what comes next, for those who use no pointer. */
  next(by) {
    const all = [...this.board.joints.map(({ name }) => ({ joint: name })), ...this.board.free.map(({ body, index }) => ({ body, index })), ...this.board.bodies.map((body) => ({ body }))];
    if (!all.length) return;
    const at = all.findIndex((ref) => JSON.stringify(ref) === JSON.stringify(this.selected));
    const ref = all[at < 0 ? (by > 0 ? 0 : all.length - 1) : (at + by + all.length) % all.length];
    this.choose(ref);
    const joint = this.board.joints.find(({ name }) => name === ref.joint);
    this.said(joint ? `${joint.name}: ${joint.bodies.join(", ")}` : ref.index === undefined ? ref.body : `${ref.body}, point ${ref.index + 1}`);
  }

  mark() {
    if (!this.viewer) return;
    for (const old of this.viewer.svg.querySelectorAll(".b-chosen, .b-mark")) old.remove();
    this.viewer.svg.append(...this.marks());
    this.backdrop.replaceChildren(...(this.picture?.drawn(this.viewer) ?? []));
    const refs = this.selected?.all ? this.board.joints.map(({ name }) => ({ joint: name })) : this.selected ? [this.selected] : [];
    for (const ref of refs) {
      const spot = ref.joint !== undefined || ref.index !== undefined ? this.spot(ref) : null;
      if (spot) this.viewer.svg.append(ring(spot, 10, "b-chosen"));
      if (ref.body !== undefined && ref.index === undefined) {
        for (const { kind, name, points } of this.viewer.scene.shapes) {
          if (kind === "body" && name === ref.body) this.viewer.svg.append(stroke(points.map((k) => this.project(k)).filter(Boolean), "b-chosen"));
        }
      }
    }
    this.grid.replaceChildren(...(this.viewer.plain && this.board.planar ? this.lines() : []));
  }

  /** What the drawing says of the file beside the mechanism: dimensions, locks, the places that are wanted. */
  marks() {
    const found = [];
    for (const [name, { between = [], tolerance }] of Object.entries(this.board.dimensions ?? {})) {
      const ends = between.map((joint) => this.spot({ joint }));
      if (ends.length !== 2 || !ends.every(Boolean)) continue;
      const [[x, y], [u, v]] = ends;
      const size = apart(...ends) || 1;
      const [dx, dy] = [(-14 * (v - y)) / size, (14 * (u - x)) / size];
      found.push(stroke([[x, y], [x + dx, y + dy], [u + dx, v + dy], [u, v]], "b-mark"));
      found.push(words([(x + u) / 2 + dx - 8, (y + v) / 2 + dy + 10], `${name}${typeof tolerance === "number" ? ` ±${tolerance}` : ""}`, "b-mark"));
    }
    for (const { name, locked } of this.board.joints) {
      const spot = locked && this.spot({ joint: name });
      if (spot) found.push(box(spot, 8, "b-mark"));
    }
    for (const { ends, lines, size } of this.tool === "select" ? this.ranges() : []) {
      found.push(...lines.map((line) => stroke(line, "b-mark b-range")), ...ends.map(({ at, words: text }) => handle(at, size, text)));
    }
    found.push(...this.wanted());
    for (const place of this.board.target?.points ?? []) {
      const [x, y] = place.every?.((v) => typeof v === "number") ? this.viewer.project(place) : [NaN, NaN];
      if (Number.isFinite(x)) found.push(stroke([[x - 5, y], [x + 5, y]], "b-mark"), stroke([[x, y - 5], [x, y + 5]], "b-mark"));
    }
    return found;
  }

  /** The line or the circle on which the output ought to be, where the file has it in numbers. */
  wanted() {
    const { line, circle } = this.board.target ?? {};
    const known = (place) => place?.every?.((v) => typeof v === "number");
    if (known(line?.through) && known(line.to)) {
      const [from, to] = [line.through, line.to].map((place) => this.viewer.project(place));
      const far = (2 * WIDTH) / (apart(from, to) || 1);
      return [stroke([-far, far + 1].map((part) => from.map((v, k) => v + part * (to[k] - v))), "b-mark b-target")];
    }
    if (!known(circle?.centre) || typeof circle.radius !== "number") return [];
    const middle = this.viewer.project(circle.centre);
    return [ring(middle, circle.radius * this.viewer.scale * this.viewer.camera.zoom, "b-mark b-target"), ring(middle, 2, "b-mark")];
  }

  lines() {
    const step = this.step() * 2;
    const [[left, top], [right, bottom]] = [this.viewer.unproject([0, 0]), this.viewer.unproject([800, 520])];
    const found = [];
    for (let x = Math.ceil(left / step) * step; x <= right; x += step) found.push(stroke([this.viewer.project([x, top]), this.viewer.project([x, bottom])], "b-grid"));
    for (let y = Math.ceil(bottom / step) * step; y <= top; y += step) found.push(stroke([this.viewer.project([left, y]), this.viewer.project([right, y])], "b-grid"));
    return found.length < 400 ? found : [];
  }
}

const apart = ([x, y], [u, v]) => Math.hypot(x - u, y - v);
const rounded = (value) => Number(value.toPrecision(9)) + 0;

function nearest([a, b], [c, d], [x, y]) {
  const length = (c - a) ** 2 + (d - b) ** 2;
  const part = length ? Math.min(1, Math.max(0, ((x - a) * (c - a) + (y - b) * (d - b)) / length)) : 0;
  return [a + part * (c - a), b + part * (d - b)];
}

/** The place along a line that is nearest to a point, as a number of corners. */
export function nearestOn(line, at) {
  let best = [Infinity, 0];
  for (let k = 0; k + 1 < line.length; k++) {
    const there = nearest(line[k], line[k + 1], at);
    const whole = apart(line[k], line[k + 1]);
    if (apart(there, at) < best[0]) best = [apart(there, at), k + (whole ? apart(line[k], there) / whole : 0)];
  }
  return best[1];
}

function made(name, attributes, text = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  return element;
}

const ring = ([cx, cy], r, kind) => made("circle", { cx, cy, r, class: kind });
const stroke = (points, kind) => made("path", { d: points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join(""), class: kind });
const box = ([x, y], r, kind) => made("rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r, class: kind });
const handle = (at, size, text) => {
  const found = box(at, size, "b-mark b-handle");
  found.append(made("title", {}, text));
  return found;
};
const words = ([x, y], text, kind = "b-new-words") => made("text", { x: x + 12, y: y - 10, class: kind }, text);
