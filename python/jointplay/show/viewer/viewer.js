// Draws a mechanism over its configurations as SVG. The data are those of scene.py: shapes through numbered points,
// the places of the points in every configuration, and how displaced states move them.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 800, HEIGHT = 520, MARGIN = 60;
// Magnifications of the slider: from one to a million, logarithmic.
const MOST_FACTOR = 6;
// Size of letters in pixels of the drawing, and the least part of it that is left on a screen.
const LETTERS = 13, LEGIBLE = 0.8;
// Where a name may stand beside its point, best first, in pixels.
const BESIDE = [[11, -11], [11, 21], [-11, -11], [-11, 21], [0, -16], [0, 28], [18, 5], [-18, 5]];

/**
 * Draws a scene into an element and gives what it can be asked: `show(configuration)`, and `update(scene)`. A home that
 * chooses configurations and states itself says `{ chosen: true }`.
 */
export function view(element, scene, { chosen = false } = {}) {
  const viewer = new Viewer(element, scene, chosen);
  viewer.draw();
  return viewer;
}

class Viewer {
  constructor(element, scene, chosen) {
    this.scene = scene;
    this.chosen = chosen;
    this.spatial = scene.axes === 3;
    this.camera = { turn: -0.9, tilt: 0.5, zoom: 1, x: 0, y: 0 };
    this.at = Math.max(0, scene.places.findIndex((places) => known(places[0])));
    this.factor = scene.factor;
    this.state = scene.states.length ? 0 : -1;
    this.shown = { region: true, cloud: true, names: true };
    element.classList.add("jp-viewer");
    this.svg = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", tabindex: 0 }, element);
    this.svg.setAttribute("aria-label", "drawing of the mechanism");
    this.layers = Object.fromEntries(
      ["path", "ghost", "solid", "cloud", "region", "error", "blamed", "names"].map((name) => [name, make("g", { class: name }, this.svg)]),
    );
    this.controls(element);
    this.text = html("ul", { class: "jp-text", "aria-live": "polite" }, element);
    this.pointer();
    this.fit();
    new ResizeObserver(() => this.draw()).observe(this.svg);
  }

  // Everything that is ever shown fits into the drawing as it is seen first.
  fit() {
    const every = [...this.scene.places.flat(), ...this.scene.path, ...(this.scene.frame ?? [])].filter(known);
    const middle = this.axes().map((_, k) => {
      const values = every.map((place) => place[k]);
      return (Math.min(...values) + Math.max(...values)) / 2;
    });
    this.middle = every.length ? middle : this.axes().map(() => 0);
    this.scale = 1;
    const seen = every.map((place) => this.project(place));
    const reach = (k) => Math.max(...seen.map((p) => Math.abs(p[k] - [WIDTH, HEIGHT][k] / 2)), 1e-12);
    this.scale = Math.min((WIDTH / 2 - MARGIN) / reach(0), (HEIGHT / 2 - MARGIN) / reach(1));
  }

  axes() {
    return Array.from({ length: this.scene.axes });
  }

  // Orthographic projection: pixels, and how near a point is.
  project(place) {
    const { turn, tilt, zoom, x, y } = this.camera;
    const [a, b, c] = place.map((value, k) => (value - this.middle[k]) * this.scale * zoom);
    if (!this.spatial) return [WIDTH / 2 + a + x, HEIGHT / 2 - b + y, 0];
    const right = Math.cos(turn) * a - Math.sin(turn) * b;
    const away = Math.sin(turn) * a + Math.cos(turn) * b;
    const up = Math.cos(tilt) * c + Math.sin(tilt) * away;
    return [WIDTH / 2 + right + x, HEIGHT / 2 - up + y, Math.sin(tilt) * c - Math.cos(tilt) * away];
  }

  // The place of a pixel; in space there is none.
  unproject([x, y]) {
    const by = this.scale * this.camera.zoom;
    return [this.middle[0] + (x - WIDTH / 2 - this.camera.x) / by, this.middle[1] - (y - HEIGHT / 2 - this.camera.y) / by];
  }

  // As another drawing of the same is seen.
  like({ middle, scale, camera, factor, shown }) {
    Object.assign(this, { middle, scale, camera: { ...camera }, shown: { ...shown } });
    this.magnify(factor);
  }

  // Another mechanism behind this one; null for none.
  ghost(scene) {
    this.behind = scene;
    this.draw();
  }

  controls(element) {
    const { scene } = this;
    const bar = html("div", { class: "jp-controls" }, element);
    const count = scene.places.length;
    if (count > 1 && !this.chosen) {
      this.play = html("button", { type: "button", title: "play or stop" }, bar);
      this.play.textContent = "▶";
      this.play.addEventListener("click", () => this.toggle());
      this.slider = labelled(bar, "configuration", "input", { type: "range", min: 0, max: count - 1, step: 1, value: this.at });
      this.slider.addEventListener("input", () => this.show(Number(this.slider.value)));
    }
    const start = Math.log10(this.factor);
    this.power = labelled(bar, "errors magnified", "input", { type: "range", min: 0, max: Math.max(MOST_FACTOR, start), step: "any", value: start });
    this.told = html("output", {}, this.power.parentElement);
    this.power.addEventListener("input", () => {
      this.factor = rounded(10 ** Number(this.power.value));
      this.draw();
    });
    if (scene.states.length && !this.chosen) {
      this.choice = labelled(bar, "drawn", "select", {});
      [...scene.states.map((state) => state.label), "nominal"].forEach((label, k) => {
        html("option", { value: k === scene.states.length ? -1 : k }, this.choice).textContent = label;
      });
      this.choice.addEventListener("input", () => {
        this.state = Number(this.choice.value);
        this.draw();
      });
    }
    const words = { region: "region of error", cloud: "specimens", names: "names" };
    for (const [name, label] of Object.entries(words)) {
      if (name !== "names" && !scene[name] && !this.chosen) continue;
      const box = labelled(bar, label, "input", { type: "checkbox", checked: "" });
      box.addEventListener("input", () => {
        this.shown[name] = box.checked;
        this.draw();
      });
    }
  }

  pointer() {
    let from = null;
    const scaled = (event) => WIDTH / this.svg.getBoundingClientRect().width;
    this.svg.addEventListener("pointerdown", (event) => {
      from = { x: event.clientX, y: event.clientY, camera: { ...this.camera } };
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener("pointerup", () => (from = null));
    this.svg.addEventListener("pointermove", (event) => {
      if (!from) return;
      const [dx, dy] = [(event.clientX - from.x) * scaled(), (event.clientY - from.y) * scaled()];
      if (this.spatial && !event.shiftKey) {
        this.camera.turn = from.camera.turn + dx / 150;
        this.camera.tilt = Math.min(1.57, Math.max(-1.57, from.camera.tilt + dy / 150));
      } else {
        this.camera.x = from.camera.x + dx;
        this.camera.y = from.camera.y + dy;
      }
      this.draw();
    });
    // A page that is scrolled stays so: the wheel zooms with Ctrl or where the drawing has the focus.
    this.svg.addEventListener(
      "wheel",
      (event) => {
        if (!event.ctrlKey && document.activeElement !== this.svg) return;
        event.preventDefault();
        this.camera.zoom = Math.min(1e6, Math.max(0.1, this.camera.zoom * Math.exp(-event.deltaY / 400)));
        this.draw();
      },
      { passive: false },
    );
    this.svg.addEventListener("dblclick", () => {
      Object.assign(this.camera, { turn: -0.9, tilt: 0.5, zoom: 1, x: 0, y: 0 });
      this.draw();
    });
    this.svg.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step) this.show(this.at + step);
    });
  }

  toggle() {
    if (this.timer) {
      clearInterval(this.timer);
      this.timer = null;
    } else {
      this.timer = setInterval(() => this.show((this.at + 1) % this.scene.places.length), Math.max(60, 4000 / this.scene.places.length));
    }
    this.play.textContent = this.timer ? "■" : "▶";
  }

  // How many times errors are as large as they are.
  magnify(factor) {
    this.factor = factor;
    this.power.max = Math.max(this.power.max, Math.log10(factor));
    this.power.value = Math.log10(factor);
    this.draw();
  }

  // Another position or state of the same mechanism, seen from where this one is.
  update(scene) {
    this.scene = { ...scene, path: this.scene.path };
    this.at = 0;
    this.state = scene.states.length ? 0 : -1;
    this.draw();
  }

  show(configuration) {
    this.at = Math.min(this.scene.places.length - 1, Math.max(0, configuration));
    if (this.slider) this.slider.value = this.at;
    this.draw();
  }

  draw() {
    const { scene, layers } = this;
    for (const layer of Object.values(layers)) layer.replaceChildren();
    this.told.textContent = `${this.factor.toLocaleString("en")} times`;
    const nominal = scene.places[this.at];
    // A home that draws on it hides errors meanwhile.
    const moves = this.state >= 0 && !this.plain ? scene.states[this.state].moves[this.at] : null;
    const displaced = moves ? nominal.map((place, k) => place.map((v, i) => (v === null || moves[k][i] === null ? null : v + this.factor * moves[k][i]))) : null;
    this.line(layers.path, scene.path.filter(known), { class: "jp-path" });
    if (displaced && known(displaced[scene.output])) {
      this.bodies(layers.ghost, nominal, "jp-ghost");
      this.shapes(layers.solid, displaced);
    } else this.shapes(layers.solid, nominal);
    for (const { kind, points, ground } of this.behind?.shapes ?? []) {
      if (kind === "body" && !ground) this.line(layers.ghost, points.map((k) => this.behind.places[0][k]), { class: "jp-ghost jp-other" }, points.length > 2);
    }
    if (!this.plain) this.errors(nominal, displaced);
    this.seen = displaced ?? nominal;
    for (const place of (scene.blamed ?? []).map((k) => (displaced ?? nominal)[k]).filter(known)) {
      const [cx, cy] = this.project(place);
      make("circle", { cx, cy, r: 13, class: "jp-blamed" }, layers.blamed);
    }
    if (this.shown.names) this.names(displaced ?? nominal);
    const lines = known(nominal[0]) ? scene.texts[this.at] ?? [] : [...(scene.texts[this.at] ?? []), "not assembled"];
    this.text.replaceChildren(...lines.map((line) => Object.assign(document.createElement("li"), { textContent: line })));
    // A home that draws on it draws again.
    this.after?.();
  }

  bodies(layer, places, className) {
    for (const shape of this.scene.shapes) {
      if (shape.kind === "body" && !shape.ground) this.line(layer, shape.points.map((k) => places[k]), { class: className }, shape.points.length > 2);
    }
  }

  shapes(layer, places) {
    const drawn = [];
    for (const shape of this.scene.shapes) {
      const points = shape.points.map((k) => places[k]).filter(known);
      if (!points.length || shape.kind === "name") continue;
      const element = this.shape(shape, points);
      if (element) drawn.push([points.map((p) => this.project(p)[2]).reduce((a, b) => a + b) / points.length + ORDER[shape.kind] * 1e6 * !this.spatial, element]);
    }
    // What is nearer covers what is farther away.
    drawn.sort((a, b) => a[0] - b[0]);
    layer.append(...drawn.map(([, element]) => element));
  }

  shape(shape, points) {
    const seen = points.map((p) => this.project(p));
    const [x, y] = seen[0];
    const at = (d) => make("path", { d, class: `jp-${shape.kind}` });
    switch (shape.kind) {
      case "body": {
        if (seen.length === 1) return shape.ground ? null : tinted(make("rect", { x: x - 4, y: y - 4, width: 8, height: 8 }), shape, true);
        const closed = seen.length > 2;
        const path = make("path", { d: way(seen, closed), class: shape.ground ? "jp-ground" : "jp-body" });
        tinted(path, shape, closed && !shape.ground);
        make("title", {}, path).textContent = shape.name;
        return path;
      }
      case "outline": {
        // What holds for three corners of a rectangle that moves with the body holds for all.
        if (seen.length < 3) return null;
        const [start, right, up] = seen;
        const along = ([a, b]) => [0, 1].map((k) => start[k] + a * (right[k] - start[k]) + b * (up[k] - start[k]));
        return tinted(at(shape.lines.map((line) => way(line.map(along), true)).join("")), shape, true);
      }
      case "guide":
      case "strut":
      case "box":
      case "strand":
      case "spring":
      case "wheel": {
        const path = at(shape.kind === "wheel" ? way(seen.slice(1), true) + way(seen.slice(0, 2)) : way(seen, shape.kind === "box"));
        return shape.colour ? tinted(path, shape) : path;
      }
      case "axis":
        return make("path", { d: way(seen), class: shape.slides ? "jp-axis jp-slides" : "jp-axis" });
      case "pin":
      case "ball":
        return make("circle", { cx: x, cy: y, r: 5, class: "jp-pin" });
      case "free":
        return make("circle", { cx: x, cy: y, r: 4, class: "jp-free" });
      case "cross":
        return at(`M${x - 5} ${y - 5}l10 10m0 -10l-10 10`);
      case "support":
        return at(`M${x} ${y}l-11 18h22zm-16 18h32`);
      case "play":
        return make("circle", { cx: x, cy: y, r: shape.radius * this.factor * this.scale * this.camera.zoom, class: "jp-play" });
      case "output":
        return at(`M${x - 8} ${y}h16M${x} ${y - 8}v16`);
      default:
        return null;
    }
  }

  // What the output can do, magnified about its nominal place, and what it does.
  errors(nominal, displaced) {
    const { scene, layers } = this;
    const centre = nominal[scene.output];
    if (!known(centre)) return;
    const magnified = (error) => centre.map((v, k) => v + this.factor * error[k]);
    const of = (name) => (this.shown[name] && scene[name] ? scene[name][this.at].filter(known).map(magnified).map((p) => this.project(p)) : []);
    const region = of("region");
    if (region.length) make("path", { d: way(hull(region), true), class: "jp-region" }, layers.region);
    const cloud = of("cloud");
    if (cloud.length) make("path", { d: cloud.map(([x, y]) => `M${x.toFixed(1)} ${y.toFixed(1)}h0`).join(""), class: "jp-cloud" }, layers.cloud);
    const [x, y] = this.project(centre);
    if (scene.limit) make("circle", { cx: x, cy: y, r: scene.limit * this.factor * this.scale * this.camera.zoom, class: "jp-limit" }, layers.region);
    // What another body sees of it is no line from the one place to the other.
    if (!scene.relative && displaced && known(displaced[scene.output])) make("path", { d: way([[x, y], this.project(displaced[scene.output])]), class: "jp-error" }, layers.error);
  }

  names(places) {
    const taken = this.covered(places);
    // A drawing that is narrower than usual has letters that can still be read.
    const k = Math.max(1, (LEGIBLE * WIDTH) / (this.svg.clientWidth || WIDTH));
    for (const shape of this.scene.shapes) {
      const place = places[shape.points[0]];
      if (shape.kind !== "name" || !known(place)) continue;
      const [x, y] = this.project(place);
      const width = 7.2 * k * shape.text.length;
      const box = ([dx, dy]) => {
        const left = x + k * dx - (dx < 0 ? width : dx === 0 ? width / 2 : 0);
        return [left, y + k * (dy - 11), left + width, y + k * (dy + 3)];
      };
      const outside = (b) => (Math.max(0, -b[0]) + Math.max(0, b[2] - WIDTH)) * (b[3] - b[1]);
      const overlap = (b) => outside(b) + taken.reduce((sum, t) => sum + Math.max(0, Math.min(b[2], t[2]) - Math.max(b[0], t[0])) * Math.max(0, Math.min(b[3], t[3]) - Math.max(b[1], t[1])), 0);
      const best = BESIDE.map(box).reduce((a, b) => (overlap(b) < overlap(a) ? b : a));
      taken.push(best);
      const text = make("text", { x: best[0], y: best[3] - 3 * k }, this.layers.names);
      text.style.fontSize = `${LETTERS * k}px`;
      text.textContent = shape.text;
    }
  }

  // Boxes that names keep clear of: marks, and pieces of the lines of bodies.
  covered(places) {
    const box = ([x, y], size) => [x - size, y - size, x + size, y + size];
    const boxes = [];
    for (const { kind, points, ground } of this.scene.shapes) {
      const seen = points.map((k) => places[k]).filter(known).map((p) => this.project(p));
      if (["pin", "ball", "cross", "output"].includes(kind)) boxes.push(...seen.map((p) => box(p, 7)));
      if (kind !== "body" || ground) continue;
      seen.forEach((from, k) => {
        const to = seen[(k + 1) % seen.length];
        const steps = Math.min(60, Math.ceil(Math.hypot(to[0] - from[0], to[1] - from[1]) / 8));
        for (let i = 0; i < steps; i++) boxes.push(box([0, 1].map((c) => from[c] + ((to[c] - from[c]) * i) / steps), 2));
      });
    }
    return boxes;
  }

  line(layer, points, attributes, closed = false) {
    if (points.length && points.every(known)) make("path", { d: way(points.map((p) => this.project(p)), closed), ...attributes }, layer);
  }
}

// In the plane: what lies over what.
const ORDER = { outline: 0, guide: 1, strut: 1, support: 1, strand: 1, wheel: 1, body: 2, spring: 3, box: 4, play: 5, axis: 6, pin: 6, ball: 6, cross: 6, free: 6, output: 7 };

const known = (place) => place.every((value) => value !== null);

function way(points, closed = false) {
  return points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("") + (closed ? "Z" : "");
}

// The convex outline of points (Andrew's monotone chain).
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const chain = (ordered) => {
    const kept = [];
    for (const p of ordered) {
      while (kept.length > 1 && cross(kept.at(-2), kept.at(-1), p) <= 0) kept.pop();
      kept.push(p);
    }
    return kept.slice(0, -1);
  };
  return sorted.length < 3 ? sorted : [...chain(sorted), ...chain(sorted.reverse())];
}

const cross = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);

// Two significant digits: what a slider gives is no measurement.
const rounded = (factor) => Number(factor.toPrecision(2));

function make(name, attributes, parent) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

// In the colour of its body, on a light and on a dark page.
function tinted(element, shape, filled = false) {
  element.style.setProperty("--jp-light", shape.colour);
  element.style.setProperty("--jp-dark", shape.dark);
  element.classList.add("jp-tinted", ...(filled ? ["jp-filled"] : []));
  return element;
}

function html(name, attributes, parent) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}

function labelled(parent, words, name, attributes) {
  const label = html("label", {}, parent);
  html("span", {}, label).textContent = words;
  return html(name, attributes, label);
}
