// Plays a mechanism along its path, to and fro, or round where the path ends where it begins.

import { element } from "./sliders.js";

// Seconds of one way at speed one, and milliseconds between two steps at least.
const WAY = 4, STEP = 40;

export class Play {
  /** `moved` is called with places along the path, `rested` when it stops. */
  constructor(place, { count, closed, moved, rested }) {
    Object.assign(this, { count, closed, moved, rested, timer: null, at: 0, way: 1 });
    this.button = element("button", { type: "button", textContent: "▶ play", title: "Space" }, place);
    this.button.addEventListener("click", () => this.toggle());
    const label = element("label", { textContent: "speed " }, place);
    this.speed = element("select", {}, label);
    for (const speed of [0.25, 0.5, 1, 2]) element("option", { value: speed, textContent: `${speed} ×`, selected: speed === 1 }, this.speed);
  }

  toggle(at = this.at) {
    if (this.timer) return this.stop();
    this.at = at;
    this.button.textContent = "■ stop";
    let before = performance.now();
    this.timer = setInterval(() => {
      const now = performance.now();
      this.step((now - before) / 1000);
      before = now;
    }, STEP);
    return null;
  }

  step(seconds) {
    const last = this.count - 1;
    this.at += (this.way * Number(this.speed.value) * last * seconds) / WAY;
    if (this.closed) this.at = ((this.at % last) + last) % last;
    else if (this.at >= last || this.at <= 0) {
      this.way = this.at >= last ? -1 : 1;
      this.at = Math.min(last, Math.max(0, this.at));
    }
    this.moved(this.at);
  }

  stop() {
    if (!this.timer) return;
    clearInterval(this.timer);
    this.timer = null;
    this.button.textContent = "▶ play";
    this.rested();
  }
}
