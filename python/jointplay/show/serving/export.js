// The drawing as a picture to save: SVG with its style in it, or PNG of twice its size.

const SIZE = [800, 520];

/** The drawing as a file, `svg` or `png`. */
export async function exported(svg, kind) {
  const copy = svg.cloneNode(true);
  for (const mark of copy.querySelectorAll(".b-chosen, .b-new, .b-grid, .b-range, .b-handle")) mark.remove();
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("class", "jp-viewer");
  SIZE.forEach((size, k) => copy.setAttribute(["width", "height"][k], size));
  const rules = [...document.styleSheets[0].cssRules].map(({ cssText }) => cssText).filter((text) => text.startsWith(".jp-viewer"));
  const style = document.createElementNS("http://www.w3.org/2000/svg", "style");
  style.textContent = rules.join("\n");
  copy.prepend(style);
  const text = new XMLSerializer().serializeToString(copy);
  if (kind === "svg") return new Blob([text], { type: "image/svg+xml" });
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = SIZE.map((size) => 2 * size);
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

// Milliseconds after which it is asked how far an animation is.
const BETWEEN = 400;

/** An animation as a file of the server's making; `said` is told how far it is, and `stop` gives it up. Null where it was given up. */
export async function animated(post, told, said, stop) {
  const number = `${Date.now()} ${Math.random()}`;
  let isDone = false;
  stop.hidden = false;
  stop.onclick = () => post("frames", { number, stop: true });
  const watch = async () => {
    while (!isDone) {
      await new Promise((resolve) => setTimeout(resolve, BETWEEN));
      const { done, count } = isDone ? {} : await post("frames", { number }).catch(() => ({}));
      if (count && !isDone) said(`animation: ${Math.round((100 * done) / count)} % …`);
    }
  };
  watch();
  try {
    const found = await post("animation", { ...told, number });
    return found.cancelled ? null : new Blob([Uint8Array.from(atob(found.content), (letter) => letter.charCodeAt(0))], { type: found.kind });
  } finally {
    isDone = true;
    stop.hidden = true;
  }
}
