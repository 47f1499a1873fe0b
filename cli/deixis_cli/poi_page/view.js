// The map from above: metres of the map frame to pixels and back, and all that is drawn. x is to the right and y up, as on the
// robot's map; both stand beside the grid.

const INK = "#1c2733";
const COLOURS = { poi: "#0b7285", chosen: "#d9480f", robot: "#2b8a3e", person: "#862e9c", wall: "#2f3e4d", x: "#c92a2a", y: "#2b8a3e" };
const FONT = '13px system-ui, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif';
const LEAST_SCALE = 0.5; // pixels a metre
const MOST_SCALE = 5000;
const DOT = 7;

export class MapView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.scale = 60;
    this.centre = [0, 0];
    this.picture = null;
  }

  // --- metres and pixels

  get size() {
    return [this.canvas.clientWidth, this.canvas.clientHeight];
  }

  toPixels([x, y]) {
    const [width, height] = this.size;
    return [width / 2 + (x - this.centre[0]) * this.scale, height / 2 - (y - this.centre[1]) * this.scale];
  }

  toMetres([right, down]) {
    const [width, height] = this.size;
    return [this.centre[0] + (right - width / 2) / this.scale, this.centre[1] - (down - height / 2) / this.scale];
  }

  panBy(right, down) {
    this.centre = [this.centre[0] - right / this.scale, this.centre[1] + down / this.scale];
  }

  zoomAt(pixel, factor) {
    const held = this.toMetres(pixel);
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    const now = this.toPixels(held);
    this.panBy(pixel[0] - now[0], pixel[1] - now[1]);
  }

  fit(points) {
    const [width, height] = this.size;
    const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
    const least = (values) => values.reduce((a, b) => Math.min(a, b)), most = (values) => values.reduce((a, b) => Math.max(a, b));
    const [left, right, low, high] = points.length ? [least(xs), most(xs), least(ys), most(ys)] : [0, 0, 0, 0];
    const across = Math.max(right - left, 2), up = Math.max(high - low, 2);
    this.centre = [(left + right) / 2, (low + high) / 2];
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, Math.min((width - 90) / across, (height - 90) / up)));
  }

  shows(place) {
    const [right, down] = this.toPixels(place), [width, height] = this.size;
    return right > 20 && right < width - 20 && down > 20 && down < height - 20;
  }

  nearest(marks, pixel, within) {
    let best = null, least = within;
    for (const mark of marks) {
      const [right, down] = this.toPixels(mark.place);
      const off = Math.hypot(right - pixel[0], down - pixel[1]);
      // Of two at one place the chosen one is held.
      if (off < least || (off === least && mark.chosen)) [best, least] = [mark, off];
    }
    return best;
  }

  // --- drawing

  draw(scene) {
    const ratio = window.devicePixelRatio || 1, [width, height] = this.size;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const pen = this.context;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = FONT;
    this.drawPicture(scene.site);
    this.drawGrid();
    this.drawWalls(scene.site);
    this.drawRobot(scene.robot, scene.name);
    for (const person of scene.persons) this.drawPerson(person);
    for (const mark of scene.marks) this.drawMark(mark);
    this.drawLabels(scene.marks, [scene.robot, ...scene.persons.map((person) => person.place)]);
    this.drawScaleBar();
  }

  drawPicture(site) {
    if (!this.picture || !site.picture) return;
    const pen = this.context, [x, y, yaw] = site.picture.origin, [across, up] = site.picture.size_m;
    const [right, down] = this.toPixels([x, y]);
    pen.save();
    pen.translate(right, down);
    pen.rotate(-yaw);
    pen.globalAlpha = 0.72; // dark enough for walls, light enough for points on them
    pen.imageSmoothingEnabled = this.scale * across < this.picture.width;
    pen.drawImage(this.picture, 0, -up * this.scale, across * this.scale, up * this.scale);
    pen.restore();
  }

  drawGrid() {
    const step = niceStep(70 / this.scale), [width, height] = this.size;
    const [left, high] = this.toMetres([0, 0]), [right, low] = this.toMetres([width, height]);
    for (let n = Math.ceil(left / step); n * step <= right; n++) {
      const at = this.toPixels([n * step, 0])[0];
      this.line([at, 0], [at, height], n ? "#1c27331f" : COLOURS.y + "66", n ? 1 : 1.5);
      this.text(said(n * step, step), at + 4, height - 6, "#1c273399");
    }
    for (let n = Math.ceil(low / step); n * step <= high; n++) {
      const at = this.toPixels([0, n * step])[1];
      this.line([0, at], [width, at], n ? "#1c27331f" : COLOURS.x + "66", n ? 1 : 1.5);
      if (at > 18 && at < height - 30) this.text(said(n * step, step), 5, at - 4, "#1c273399");
    }
    this.drawAxes();
  }

  drawAxes() {
    const [right, down] = this.toPixels([0, 0]), length = 38;
    this.arrow([right, down], [right + length, down], COLOURS.x);
    this.arrow([right, down], [right, down - length], COLOURS.y);
    this.text("x", right + length + 5, down + 4, COLOURS.x);
    this.text("y", right - 3, down - length - 6, COLOURS.y);
  }

  drawWalls(site) {
    for (const [from, to] of site.walls) this.line(this.toPixels(from), this.toPixels(to), COLOURS.wall, 3);
  }

  drawRobot([x, y, yaw], name) {
    const pen = this.context, [right, down] = this.toPixels([x, y]), size = Math.max(11, 0.22 * this.scale);
    pen.save();
    pen.translate(right, down);
    pen.rotate((-yaw * Math.PI) / 180);
    pen.beginPath();
    pen.moveTo(size * 1.3, 0);
    pen.lineTo(-size, size * 0.85);
    pen.lineTo(-size * 0.55, 0);
    pen.lineTo(-size, -size * 0.85);
    pen.closePath();
    pen.fillStyle = COLOURS.robot;
    pen.strokeStyle = "#fff";
    pen.lineWidth = 2;
    pen.fill();
    pen.stroke();
    pen.restore();
    pen.textAlign = "center";
    this.text(name, right, down + size + 16, COLOURS.robot);
    pen.textAlign = "start";
  }

  drawPerson(person) {
    const place = this.toPixels(person.place);
    if (person.at) {
      this.context.setLineDash([7, 5]);
      this.line(place, this.toPixels(person.at), COLOURS.person, 2.5);
      this.context.setLineDash([]);
    }
    this.disc(place, 9, COLOURS.person, "#fff");
    this.text(`person ${person.person_id}`, place[0] + 13, place[1] + 5, COLOURS.person);
  }

  drawMark(mark) {
    const pen = this.context, place = this.toPixels(mark.place), colour = mark.chosen ? COLOURS.chosen : COLOURS.poi;
    const radius = (mark.extent / 2) * this.scale;
    if (Number.isFinite(radius) && radius > DOT) {
      pen.beginPath();
      pen.arc(...place, radius, 0, 2 * Math.PI);
      pen.fillStyle = colour + "22";
      pen.fill();
      pen.setLineDash(mark.unsaved ? [4, 4] : []);
      this.stroke(colour + "99", 1.5);
      pen.setLineDash([]);
    }
    if (mark.from) {
      pen.setLineDash([2, 4]);
      this.line(this.toPixels(mark.from), place, colour, 1.5);
      pen.setLineDash([]);
    }
    this.disc(place, mark.chosen ? DOT + 2 : DOT, mark.unsaved ? "#fff" : colour, mark.unsaved ? colour : "#fff");
  }

  // Names, the chosen one first; one that would lie over another waits until the map is nearer.
  drawLabels(marks, others) {
    const taken = marks.length > 400 ? marks.filter((m) => this.shows(m.place)) : marks;
    const boxes = taken.slice(0, 2000).map((mark) => around(this.toPixels(mark.place), DOT));
    for (const place of others) boxes.push(around(this.toPixels(place), 14));
    const labels = [];
    const ordered = [...taken.filter((m) => m.chosen), ...taken.filter((m) => !m.chosen)].slice(0, 2000);
    for (const mark of ordered) {
      const [right, down] = this.toPixels(mark.place), wide = this.context.measureText(mark.name).width;
      for (const [x, y] of [[right + 12, down + 5], [right - 12 - wide, down + 5], [right - wide / 2, down - 13], [right - wide / 2, down + 23]]) {
        const box = [x - 2, y - 13, x + wide + 2, y + 3];
        const free = !labels.some((other) => meets(box, other)) && !boxes.some((other) => meets(box, other));
        if (!free && !(mark.chosen && x > right)) continue;
        labels.push(box);
        this.text(mark.name, x, y, mark.chosen ? COLOURS.chosen : INK);
        break;
      }
    }
  }

  drawScaleBar() {
    const metres = niceStep(80 / this.scale), length = metres * this.scale, down = this.size[1] - 34, left = 44;
    for (const [colour, wide] of [["#fff", 5], [INK, 2]]) {
      this.line([left, down], [left + length, down], colour, wide);
      for (const at of [left, left + length]) this.line([at, down - 5], [at, down + 5], colour, wide);
    }
    this.text(metres < 1 ? `${Math.round(metres * 100)} cm` : `${metres} m`, left + length + 8, down + 5, INK);
  }

  line(from, to, colour, wide) {
    const pen = this.context;
    pen.beginPath();
    pen.moveTo(...from);
    pen.lineTo(...to);
    this.stroke(colour, wide);
  }

  stroke(colour, wide) {
    Object.assign(this.context, { strokeStyle: colour, lineWidth: wide, lineCap: "round" });
    this.context.stroke();
  }

  arrow(from, to, colour) {
    const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
    this.line(from, to, colour, 2);
    for (const turn of [2.6, -2.6]) this.line(to, [to[0] + 8 * Math.cos(angle + turn), to[1] + 8 * Math.sin(angle + turn)], colour, 2);
  }

  disc(place, radius, fill, edge) {
    const pen = this.context;
    pen.beginPath();
    pen.arc(...place, radius, 0, 2 * Math.PI);
    pen.fillStyle = fill;
    pen.fill();
    this.stroke(edge, 2.5);
  }

  text(text, x, y, colour) {
    const pen = this.context;
    Object.assign(pen, { strokeStyle: "#fffd", lineWidth: 4, lineJoin: "round", fillStyle: colour });
    pen.strokeText(text, x, y);
    pen.fillText(text, x, y);
  }
}

// The smallest of 1, 2, 5, 10 ... that is at least so much.
function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least * 0.999);
}

function said(value, step) {
  return value.toFixed(Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
}

function around([x, y], radius) {
  return [x - radius, y - radius, x + radius, y + radius];
}

function meets(one, other) {
  return one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];
}
