// The guided first drawing: what to do next, beside where it is done. A step that is done leads to the next one.

import { element } from "./sliders.js";

const joints = (board) => board.joints.filter(({ kind }) => kind === "revolute").length;
const grounded = (board) => board.joints.filter(({ bodies }) => bodies.includes("ground")).length;

/** What a step says, what it points at, and whether a board has what it asks for. */
const STEPS = [
  { text: "Draw three bars in a chain: press B, then click both ends of each. A bar that begins where another one ends is joined with a pin.", at: "[data-tool=bar]", done: (board) => joints(board) >= 2 },
  { text: "Pin both open ends to the ground: press G and click on them.", at: "[data-tool=ground]", done: (board) => grounded(board) >= 2 },
  { text: "A motor: press D and click on a pin of the ground.", at: "[data-tool=drive]", done: (board) => Object.keys(board.drives).length > 0 },
  { text: "Which point matters? Press O and click on it.", at: "[data-tool=output]", done: (board) => Boolean(board.output?.body) },
  { text: "Give the pins play: Ctrl-A chooses all of them; then choose a fit, or a radial clearance, on the right.", at: "#inspector .play, #parts", done: (board) => board.joints.some(({ clearance }) => clearance) },
  { text: "What is acceptable? Type a limit of the position. The line below has the verdict.", at: "#limits input", done: (board) => Object.keys(board.limits).length > 0 },
  { text: "That is all: drag a joint, move a slider, press Space to play. Ctrl-Z takes back whatever you did.", at: "#line", done: () => false },
];

export class Tour {
  constructor(before) {
    this.place = element("div", { id: "tour", hidden: true });
    this.place.setAttribute("role", "status");
    this.place.setAttribute("aria-label", "guide");
    before.before(this.place);
  }

  start(board) {
    this.number = 0;
    this.place.hidden = false;
    this.shown(board);
  }

  stop() {
    this.place.hidden = true;
    this.place.replaceChildren();
    this.point(null);
  }

  /** Another state of the board: goes on behind what it has. */
  shown(board) {
    if (this.place.hidden) return;
    while (STEPS[this.number].done(board)) this.number += 1;
    this.say();
  }

  say() {
    const { text, at } = STEPS[this.number];
    this.place.replaceChildren();
    element("p", { textContent: `${this.number + 1} of ${STEPS.length}: ${text}` }, this.place);
    const bar = element("div", { className: "bar" }, this.place);
    const last = this.number === STEPS.length - 1;
    if (!last) element("button", { type: "button", textContent: "next" }, bar).addEventListener("click", () => ((this.number += 1), this.say()));
    element("button", { type: "button", textContent: last ? "done" : "stop the guide" }, bar).addEventListener("click", () => this.stop());
    this.point(document.querySelector(at));
  }

  point(element) {
    for (const old of document.querySelectorAll(".pointed")) old.classList.remove("pointed");
    element?.classList.add("pointed");
  }
}
