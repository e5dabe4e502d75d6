// A picture behind the drawing, to draw over: where it is in the drawing, and how large. The browser keeps it under the name of the
// file; the file does not have it.

const KEY = "jointplay.picture ";
// Bytes of a file, and pixels of a picture, up to which a page stays quick.
const LARGEST = 20e6;
const MOST = 50e6;
const SVG = "http://www.w3.org/2000/svg";

export class Picture {
  constructor({ href, at, size }) {
    // Where its lower left corner is, its width and its height, in units of the file.
    Object.assign(this, { href, at, size });
  }

  /** A picture of a file, as wide as the present view. */
  static async of(file, viewer) {
    if (file.size > LARGEST) throw new Error(`${file.name} has ${Math.ceil(file.size / 1e6)} MB; a picture has at most ${LARGEST / 1e6} MB`);
    const href = await new Promise((resolve, reject) => {
      const reader = new FileReader();
      reader.onload = () => resolve(reader.result);
      reader.onerror = () => reject(new Error(`${file.name} cannot be read`));
      reader.readAsDataURL(file);
    });
    const image = new Image();
    image.src = href;
    await image.decode().catch(() => Promise.reject(new Error(`${file.name} is not a picture`)));
    if (image.width * image.height > MOST) throw new Error(`${file.name} has ${image.width} x ${image.height} pixels; a picture has at most ${MOST / 1e6} million`);
    const [[left, top], [right, bottom]] = [viewer.unproject([0, 0]), viewer.unproject([800, 520])];
    const scale = Math.min((right - left) / image.width, (top - bottom) / image.height);
    return new Picture({ href, at: [left, bottom], size: [image.width * scale, image.height * scale] });
  }

  /** The same picture in which two places are so far apart; the first one stays where it is. */
  scaled([from, to], distance) {
    const by = distance / Math.hypot(to[0] - from[0], to[1] - from[1]);
    return new Picture({ href: this.href, at: this.at.map((v, k) => from[k] + (v - from[k]) * by), size: this.size.map((v) => v * by) });
  }

  drawn(viewer) {
    const image = document.createElementNS(SVG, "image");
    const [x, bottom] = viewer.project(this.at);
    const [right, y] = viewer.project(this.at.map((v, k) => v + this.size[k]));
    for (const [key, value] of Object.entries({ href: this.href, x, y, width: right - x, height: bottom - y, opacity: 0.5, preserveAspectRatio: "none" })) image.setAttribute(key, value);
    return [image];
  }
}

/** The picture that was behind a file; null where there is none. */
export function pictureOf(name) {
  try {
    const own = JSON.parse(localStorage.getItem(KEY + name));
    return own && new Picture(own);
  } catch {
    return null;
  }
}

export function keepPicture(name, picture) {
  try {
    if (picture) localStorage.setItem(KEY + name, JSON.stringify(picture));
    else localStorage.removeItem(KEY + name);
  } catch {
    // A large picture is there as long as the page is.
  }
}
