// Small charts: curves along the path with a limit and a mark where the sliders are, and bars of shares.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 420, HEIGHT = 190, LEFT = 58, RIGHT = 12, TOP = 24, BOTTOM = 34;

/**
 * Draws curves {name, values, exact} over numbers, with the place where the sliders are (null: not on the axis), and limits. One
 * is dragged where `limited` takes another one (null: none).
 */
export function chart(element, { title, unit, label, x, curves, limits, here, limited = null }) {
  const svg = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img" });
  svg.setAttribute("aria-label", `${title} along the path`);
  const known = curves.flatMap(({ values }) => values).filter((v) => v !== null);
  // Where nothing is off there is nothing to scale: the axis has its zero alone.
  const [least, most] = [Math.min, Math.max].map((end) => end(...known, ...limits, 0));
  const [bottom, top] = [least * 1.08, (most || (least ? 0 : 1)) * 1.08];
  const places = x.filter((v) => v !== null);
  const [low, high] = [Math.min(...places), Math.max(...places)];
  const right = (v) => LEFT + ((v - low) / (high - low || 1)) * (WIDTH - LEFT - RIGHT);
  const up = (v) => HEIGHT - BOTTOM - ((v - bottom) / (top - bottom)) * (HEIGHT - TOP - BOTTOM);
  for (const tick of most || least ? ticks(bottom, top) : [0]) {
    make("path", { d: `M${LEFT} ${up(tick)}H${WIDTH - RIGHT}`, class: "grid" }, svg);
    text(svg, LEFT - 6, up(tick) + 4, short(tick), "end");
  }
  for (const tick of places.length > 1 ? ticks(low, high) : places) text(svg, right(tick), HEIGHT - BOTTOM + 15, short(tick), "middle");
  text(svg, LEFT, 14, `${title} [${unit}]`, "start", "title");
  text(svg, WIDTH - RIGHT, HEIGHT - 4, label, "end");
  for (const limit of limits) {
    make("path", { d: `M${LEFT} ${up(limit)}H${WIDTH - RIGHT}`, class: "limit" }, svg);
    const told = text(svg, WIDTH - RIGHT, up(limit) - 4, "limit", "end");
    if (limited) dragged(svg, { limit, up, top, told, limited });
  }
  if (here !== null && here >= low && here <= high) make("path", { d: `M${right(here)} ${TOP}V${HEIGHT - BOTTOM}`, class: "here" }, svg);
  for (const { name, values, exact } of curves) {
    let d = "", pen = "M";
    values.forEach((v, k) => {
      if (v === null || x[k] === null) pen = "M";
      else {
        d += `${pen}${right(x[k]).toFixed(1)} ${up(v).toFixed(1)}`;
        pen = "L";
        make("circle", { cx: right(x[k]), cy: up(v), r: 2, class: `dot ${name}` }, svg);
      }
    });
    const line = make("path", { d, class: `curve ${name}${exact ? "" : " rough"}` }, svg);
    make("title", {}, line).textContent = `${name}${exact ? "" : ", not yet exact"}`;
  }
  element.replaceChildren(svg);
}

/** Draws shares [[name, share], ...] as bars. */
export function bars(element, shares) {
  const most = Math.max(...shares.map(([, share]) => Math.abs(share))) || 1;
  element.replaceChildren(
    ...shares.map(([name, share]) => {
      const row = document.createElement("div");
      row.className = "share";
      const label = Object.assign(document.createElement("span"), { textContent: name });
      const bar = make("svg", { viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": true });
      // What makes the error smaller is drawn from the right, and empty.
      const width = (100 * Math.abs(share)) / most;
      make("rect", { width, height: 10, ...(share < 0 ? { x: 100 - width, class: "less" } : {}) }, bar);
      const value = Object.assign(document.createElement("span"), { textContent: `${(100 * share).toFixed(0)} %` });
      row.append(label, bar, value);
      return row;
    }),
  );
}

/** The line of the limit follows a pointer; where it is let go it is the limit, with two digits. */
function dragged(svg, { limit, up, top, told, limited }) {
  const line = svg.querySelector(".limit");
  const grip = make("path", { d: line.getAttribute("d"), class: "grip" }, svg);
  make("title", {}, grip).textContent = "drag the limit";
  let next = null;
  grip.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    grip.setPointerCapture(event.pointerId);
    // Answers that come meanwhile wait until it is let go.
    grip.classList.add("held");
    next = limit;
  });
  grip.addEventListener("pointermove", (event) => {
    if (next === null) return;
    const box = svg.getBoundingClientRect();
    const part = (up(0) - ((event.clientY - box.top) * HEIGHT) / box.height) / (up(0) - up(top));
    next = Number(Math.max(part * top, top / 1000).toPrecision(2));
    for (const one of [line, grip]) one.setAttribute("d", `M${LEFT} ${up(next)}H${WIDTH - RIGHT}`);
    told.setAttribute("y", up(next) - 4);
    told.textContent = `limit ${next}`;
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    grip.addEventListener(kind, () => {
      grip.classList.remove("held");
      limited(kind === "pointerup" && next !== limit ? next : null);
      next = null;
    });
  }
}

// Round numbers between two others.
function ticks(low, high) {
  const rough = (high - low) / 4 || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough);
  const found = [];
  for (let v = Math.ceil(low / step) * step; v <= high * (1 + 1e-12) + 1e-300; v += step) found.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return found;
}

/** A number with four digits. */
export const short = (value) => String(Number(value.toPrecision(4)));

function text(svg, x, y, words, anchor, kind = "") {
  return Object.assign(make("text", { x, y, "text-anchor": anchor, class: kind }, svg), { textContent: words });
}

function make(name, attributes, parent) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}
