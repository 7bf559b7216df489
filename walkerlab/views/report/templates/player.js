const TAU = 2 * Math.PI;
const UNITS = [[1, "m"], [1e-3, "mm"], [1e-6, "µm"], [1e-9, "nm"]];
const minus = (text) => text.replace("-", "−");
const digits = (value, count = 4) => (value === undefined ? "–" : minus(Math.abs(value) < 1e-12 ? "0" : Number(value.toPrecision(count)).toString()));
// Lengths below a nanometre are rounding errors and shown as zero.
const metres = (value, count = 3) => {
  const [scale, unit] = UNITS.find(([size]) => Math.abs(value) >= size) ?? [Infinity, "m"];
  return `${digits(value / scale, count)} ${unit}`;
};
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

// A walker's recorded motion, and its values at the current instant.
class Track {
  constructor(meta, packed) {
    Object.assign(this, meta);
    const letters = atob(packed);
    const bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
    const floats = new Float32Array(bytes.buffer);
    this.all = {};
    this.channels.forEach((name, index) => (this.all[name] = floats.subarray(index * this.samples, (index + 1) * this.samples)));
    this.end = this.all.t[this.samples - 1];
    this.seek(0);
  }
  has(name) {
    return name in this.all;
  }
  seek(time) {
    const t = this.all.t;
    let [low, high] = [0, this.samples - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (t[middle] <= time) low = middle;
      else high = middle;
    }
    this.row = low;
    this.share = t[high] > t[low] ? clamp((time - t[low]) / (t[high] - t[low]), 0, 1) : 0;
    this.over = time > this.end + 1e-6;
    this.time = time;
  }
  // The leg that pushes off, or -1 if no leg does. A push-off lasts for 0.08 s here, to make it visible.
  get pushing() {
    const step = this.strikes.findLastIndex((strike) => strike <= this.time);
    return this.pushes && step >= 0 && this.time - this.strikes[step] < 0.08 ? 1 - (step % 2) : -1;
  }
  at(name) {
    const values = this.all[name];
    return values && values[this.row] + this.share * (values[Math.min(this.row + 1, this.samples - 1)] - values[this.row]);
  }
  get stance() {
    if (this.has("s")) return this.all.s[this.row + (this.share === 1 ? 1 : 0)];
    return this.at("n0") >= this.at("n1") ? 0 : 1;
  }
}

// A canvas that is as wide as its container, and sharp on every screen.
class Picture {
  constructor(canvas, shape) {
    Object.assign(this, { canvas, shape, context: canvas.getContext("2d") });
  }
  fit() {
    const dots = Math.min(devicePixelRatio || 1, 2);
    this.width = Math.max(200, this.canvas.parentElement.clientWidth);
    this.height = Math.round(this.width * this.shape(this.width));
    this.canvas.width = this.width * dots;
    this.canvas.height = this.height * dots;
    this.canvas.style.height = `${this.height}px`;
    this.context.setTransform(dots, 0, 0, dots, 0, 0);
  }
}

function arrow(c, x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  if (length < 2) return;
  const head = Math.min(9, 0.5 * length);
  const [ux, uy] = [dx / length, dy / length];
  c.beginPath();
  c.moveTo(x, y);
  c.lineTo(x + dx, y + dy);
  c.moveTo(x + dx - head * (ux + 0.5 * uy), y + dy - head * (uy - 0.5 * ux));
  c.lineTo(x + dx, y + dy);
  c.lineTo(x + dx - head * (ux - 0.5 * uy), y + dy - head * (uy + 0.5 * ux));
  c.stroke();
}

// Draw the force on a foot as an arrow, which is `unit` long for an ordinary force and never longer than `most`.
function force(c, scene, track, leg, x, y, unit, most) {
  const [normal, along] = [track.at(`n${leg}`), track.at(`d${leg}`) ?? 0];
  if (!normal || normal < 0) return;
  const scale = Math.min(unit / scene.ordinary_force, most / Math.hypot(normal, along));
  arrow(c, x, y, along * scale, -normal * scale);
}

function drawWalk(picture, scene, tracks, colours, back = 0) {
  const { context: c, width, height } = picture;
  const scale = (0.66 * height) / (scene.leg_m + scene.torso_m);
  const [sin, cos] = [Math.sin(scene.slope_rad), Math.cos(scene.slope_rad)];
  // The camera follows the walkers that still walk. Within half a second, it leaves one whose walk has ended.
  const shares = tracks.map((track) => clamp(1 - (track.time - track.end) / 0.5, 0, 1));
  const hip = tracks.reduce((sum, track, index) => sum + shares[index] * track.at("hx"), 0) / shares.reduce((sum, share) => sum + share, 0);
  const toPixels = picture.toPixels = (x, y) => [
    width / 2 + scale * (cos * (x - hip) + sin * y),
    0.83 * height + scale * (sin * (x - hip) - cos * y),
  ];
  const across = (0.75 * width) / scale;
  const slab = (from, to, top, bottom, fill) => {
    const corners = [[from, top], [to, top], [to, bottom], [from, bottom]].map(([x, y]) => toPixels(x, y));
    c.fillStyle = fill;
    c.beginPath();
    for (const [x, y] of corners) c.lineTo(x, y);
    c.fill();
  };
  c.clearRect(0, 0, width, height);
  const under = scene.pads.length ? -0.04 * scene.leg_m : 0;
  const levels = levelsOf(scene, hip - across, hip + across);
  for (const [from, to, height] of levels) slab(from, to, height, -scene.leg_m, colours.ground);
  c.globalAlpha = 0.55;
  for (const [from, to, leg] of scene.pads) {
    if (to > hip - across && from < hip + across) slab(from, to, 0, under, colours[`leg-${leg + 1}`]);
  }
  c.globalAlpha = 1;
  c.strokeStyle = colours.soft;
  c.lineWidth = 1;
  c.beginPath();
  levels.forEach(([from, to, height], k) => {
    if (k === 0) c.moveTo(...toPixels(from, height));
    c.lineTo(...toPixels(from, height));
    c.lineTo(...toPixels(to, height));
  });
  const tick = 0.5 * scene.leg_m;
  const ticks = [];
  for (let i = Math.ceil((hip + back - across) / tick); i * tick < hip + back + across; i++) ticks.push(i * tick);
  for (const far of ticks) {
    c.moveTo(...toPixels(far - back, under));
    c.lineTo(...toPixels(far - back, under - 0.03 * scene.leg_m));
  }
  c.stroke();
  c.fillStyle = colours.soft;
  c.font = "12px system-ui, sans-serif";
  c.textAlign = "center";
  for (const far of ticks) {
    const [x, y] = toPixels(far - back, under - 0.1 * scene.leg_m);
    const label = `${digits(far)} m`;
    const room = 0.5 * c.measureText(label).width;
    if (x > room && x < width - room) c.fillText(label, x, y);
  }
  drawRelief(picture, scene, levels, colours);
  picture.points = [];
  tracks.forEach((track, index) => drawWalker(picture, scene, track, colours, scale, index));
}

// Draw uneven ground a second time, below the first, with exaggerated heights and a label that shows the factor.
function drawRelief({ context: c, toPixels, height }, scene, levels, colours) {
  const roughest = Math.max(0, ...scene.ground.map(([, level]) => Math.abs(level)));
  const times = roughest ? niceStep((0.04 * scene.leg_m) / roughest) : 0;
  if (times <= 1) return;
  c.strokeStyle = c.fillStyle = colours.bad;
  c.beginPath();
  for (const [from, to, level] of levels) for (const x of [from, to]) c.lineTo(...toPixels(x, times * level - 0.19 * scene.leg_m));
  c.stroke();
  c.textAlign = "left";
  c.fillText(`red line: ground heights × ${digits(times)}`, 8, height - 8);
}

function drawWalker(picture, scene, track, colours, scale, index) {
  const { context: c, toPixels, points } = picture;
  const broad = index === 0 ? 10 : 5;
  const joint = (name) => toPixels(track.at(name[0] + "x" + name.slice(1)), track.at(name[0] + "y" + name.slice(1)));
  c.lineCap = c.lineJoin = "round";
  c.globalAlpha = track.over ? 0.35 : index === 0 && !track.alone ? 0.75 : 1;
  for (const leg of [1, 0]) {
    const bent = track.has(`kx${leg}`);
    c.strokeStyle = c.fillStyle = colours[track.style];
    const path = new Path2D();
    for (const name of bent ? ["h", `k${leg}`] : ["h"]) path.lineTo(...joint(name));
    // The sole is where the leg's direction meets the foot's arc.
    const [x, y] = toPixels(track.at(`fx${leg}`), track.at(`fy${leg}`) + scene.foot_radii_m[leg]);
    const radius = scale * scene.foot_radii_m[leg];
    const down = Math.PI / 2 - (track.at(`b${leg}`) ?? track.at(`a${leg}`));
    path.lineTo(x + radius * Math.cos(down), y + radius * Math.sin(down));
    if (scene.foot_radii_m[leg] > 0.01 * scene.leg_m) {
      path.moveTo(x + radius * Math.cos(down - 0.6), y + radius * Math.sin(down - 0.6));
      path.arc(x, y, radius, down - 0.6, down + 0.6);
    }
    c.lineWidth = broad;
    c.stroke(path);
    if (leg === 1) {
      c.strokeStyle = colours.paper;
      c.lineWidth = 0.4 * broad;
      c.stroke(path);
    }
    if (bent) dot(c, joint(`k${leg}`), 0.7 * broad, colours[track.style]);
    points.push({ at: joint(`f${leg}`), text: `${track.name}, foot of leg ${leg + 1}: ${metres(track.at(`fx${leg}`), 4)} along, ${metres(track.at(`fy${leg}`))} above` });
  }
  if (track.has("u") && scene.torso_m) {
    const tilted = track.at("u") + scene.slope_rad;
    c.strokeStyle = colours[track.style];
    c.lineWidth = broad;
    c.beginPath();
    c.moveTo(...joint("h"));
    c.lineTo(...toPixels(track.at("hx") + scene.torso_m * Math.sin(tilted), track.at("hy") + scene.torso_m * Math.cos(tilted)));
    c.stroke();
  }
  dot(c, joint("h"), broad, colours[track.style]);
  points.push({ at: joint("h"), text: `${track.name}, hip: ${metres(track.at("hx"), 4)} along, ${metres(track.at("hy"), 4)} above` });
  c.strokeStyle = colours.force;
  c.lineWidth = 2;
  for (const leg of [0, 1]) {
    c.save();
    c.translate(...joint(`f${leg}`));
    c.rotate(scene.slope_rad);
    force(c, scene, track, leg, 0, 0, 0.3 * scale * scene.leg_m, 0.8 * scale * scene.leg_m);
    c.restore();
  }
  const leg = track.pushing;
  if (leg >= 0) {
    const [[x, y], [hx, hy]] = [joint(`f${leg}`), joint("h")];
    c.strokeStyle = colours.bad;
    c.lineWidth = 5;
    arrow(c, x, y, 0.3 * (hx - x), 0.3 * (hy - y));
  }
  c.globalAlpha = 1;
}

function dot(c, [x, y], radius, fill) {
  c.fillStyle = fill;
  c.beginPath();
  c.arc(x, y, radius, 0, TAU);
  c.fill();
}

// Ground levels between two positions, each as [start, end, height above the slope].
function levelsOf(scene, left, right) {
  const levels = scene.ground.length ? scene.ground : [[-Infinity, 0]];
  return levels
    .map(([from, height], k) => [Math.max(left, from), Math.min(right, (levels[k + 1] ?? [Infinity])[0]), height])
    .filter(([from, to]) => from < to);
}

// Height of a foot above the ground below it (m).
function clearance(scene, track, leg) {
  const x = track.at(`fx${leg}`);
  return track.at(`fy${leg}`) - levelsOf(scene, x - 1e-9, x + 1e-9)[0][2];
}

// Draw one foot on the slope, as if that were level: penetration, slip and forces.
function drawFoot(picture, scene, track, leg, colours) {
  const { context: c, width, height } = picture;
  const scale = height / scene.closeup_m;
  const ground = 0.68 * height;
  const mark = 0.5 * width;
  const slip = track.at(`q${leg}`) ?? 0;
  const x = mark + clamp(scale * slip, -0.42 * width, 0.42 * width);
  const sole = ground - scale * clearance(scene, track, leg);
  const radius = Math.max(scale * scene.foot_radii_m[leg], 0.02 * height);
  c.clearRect(0, 0, width, height);
  c.fillStyle = colours.ground;
  c.fillRect(0, ground, width, height - ground);
  const foot = new Path2D();
  if (scene.foot_radii_m[leg] > 0) foot.arc(x, sole - radius, radius, 0, TAU);
  else [[x, sole], [x - 0.3 * height, sole - height], [x + 0.3 * height, sole - height]].forEach((corner) => foot.lineTo(...corner));
  const visible = sole > 0;
  if (visible) {
    c.globalAlpha = 0.8;
    c.fillStyle = colours[track.style];
    c.fill(foot);
    c.globalAlpha = 1;
    c.save();
    c.beginPath();
    c.rect(0, ground, width, height);
    c.clip();
    c.fillStyle = colours.bad;
    c.fill(foot);
    c.restore();
  }
  c.strokeStyle = c.fillStyle = colours.ink;
  c.lineWidth = 1;
  c.beginPath();
  c.moveTo(0, ground);
  c.lineTo(width, ground);
  c.moveTo(mark, ground - 7);
  c.lineTo(mark, ground + 7);
  c.stroke();
  c.font = "12px system-ui, sans-serif";
  c.textAlign = "left";
  const bar = niceStep(scene.closeup_m / 3);
  c.fillText(metres(bar, 1), 8, height - 14);
  c.fillRect(8, height - 9, scale * bar, 2);
  if (!visible) {
    c.textAlign = "center";
    c.fillText(`${metres(clearance(scene, track, leg))} above the ground`, width / 2, 0.3 * height);
    arrow(c, width / 2, 0.25 * height, 0, -0.15 * height);
  }
  c.lineWidth = 2;
  if (Math.abs(x - mark) > 3) arrow(c, mark, ground + 16, x - mark, 0);
  c.strokeStyle = colours.force;
  c.lineWidth = 3;
  force(c, scene, track, leg, x, Math.min(sole, ground + 0.2 * height), 0.4 * height, 0.62 * height);
}

function describeFoot(track, leg) {
  const parts = [`leg ${leg + 1}`];
  if (track.has("p0")) parts.push(`penetration ${metres(track.at(`p${leg}`))}`);
  if (track.has("q0")) parts.push(`slip ${metres(track.at(`q${leg}`))}`);
  if (track.has("n0")) parts.push(`normal ${digits(track.at(`n${leg}`), 3)} N`);
  if (track.has("d0")) parts.push(`friction ${digits(track.at(`d${leg}`), 3)} N`);
  return parts.join(", ");
}

const niceStep = (rough) => {
  const ten = 10 ** Math.floor(Math.log10(rough));
  return ten * ([5, 2, 1].find((step) => step * ten <= rough) ?? 1);
};

// A plot, whose curves are drawn once and whose cursor moves in a layer above them.
class Plot {
  static WIDTH = 340;
  static HEIGHT = 230;
  static FRAME = [46, 8, 8, 36];

  constructor(container, titles, unit, inTime, seek) {
    Object.assign(this, { container, titles, unit, inTime });
    const sheet = document.createElement("div");
    sheet.className = "sheet";
    this.curves = element("svg", { viewBox: `0 0 ${Plot.WIDTH} ${Plot.HEIGHT}`, role: "img" });
    this.cursor = element("svg", { viewBox: `0 0 ${Plot.WIDTH} ${Plot.HEIGHT}`, class: "cursor", "aria-hidden": "true" });
    this.tip = document.createElement("output");
    this.tip.className = "tip";
    sheet.append(this.curves, this.cursor, this.tip);
    container.append(sheet);
    const look = (event) => this.look(event, seek);
    this.cursor.addEventListener("pointermove", look);
    this.cursor.addEventListener("pointerdown", (event) => {
      this.cursor.setPointerCapture(event.pointerId);
      look(event);
    });
    this.cursor.addEventListener("pointerleave", () => (this.tip.textContent = ""));
  }

  draw(series, description) {
    this.series = series;
    const [left, top, right, bottom] = Plot.FRAME;
    const limits = (key) => {
      const all = series.flatMap((one) => [one[key].reduce((a, b) => Math.min(a, b)), one[key].reduce((a, b) => Math.max(a, b))]);
      const [low, high] = [Math.min(...all), Math.max(...all)];
      const pad = key === "x" && this.inTime ? 0 : 0.05 * (high - low || 1);
      return [low - pad, high + pad];
    };
    const [x, y] = [limits("x"), limits("y")];
    this.toX = (value) => left + ((value - x[0]) / (x[1] - x[0])) * (Plot.WIDTH - left - right);
    this.toY = (value) => Plot.HEIGHT - bottom - ((value - y[0]) / (y[1] - y[0])) * (Plot.HEIGHT - top - bottom);
    this.fromX = (pixel) => x[0] + ((pixel - left) / (Plot.WIDTH - left - right)) * (x[1] - x[0]);
    this.curves.setAttribute("aria-label", description);
    this.curves.replaceChildren(...this.axis(x, true), ...this.axis(y, false), ...series.map((one) => this.curve(one)));
    this.line = element("line", { class: "now", y1: top, y2: Plot.HEIGHT - bottom });
    this.dots = series.map((one) => element("circle", { r: 4.5, class: one.style }));
    this.cursor.replaceChildren(...(this.inTime ? [this.line] : []), ...this.dots);
  }

  axis([low, high], horizontal) {
    const [left, top, right, bottom] = Plot.FRAME;
    const step = niceStep((high - low) / (horizontal ? 4 : 3));
    const parts = [];
    for (let i = Math.ceil(low / step); i * step <= high; i++) {
      const at = horizontal ? this.toX(i * step) : this.toY(i * step);
      const ends = horizontal ? { x1: at, x2: at, y1: top, y2: Plot.HEIGHT - bottom } : { y1: at, y2: at, x1: left, x2: Plot.WIDTH - right };
      const label = horizontal ? { x: at, y: Plot.HEIGHT - bottom + 15, class: "middle" } : { x: left - 5, y: at + 4, class: "last" };
      parts.push(element("line", { class: "grid", ...ends }), element("text", label, this.label(i * step, horizontal)));
    }
    const title = horizontal
      ? { x: (left + Plot.WIDTH - right) / 2, y: Plot.HEIGHT - 4, class: "middle" }
      : { transform: `translate(11 ${(top + Plot.HEIGHT - bottom) / 2}) rotate(-90)`, class: "middle" };
    parts.push(element("text", title, this.titles[horizontal ? 0 : 1]));
    return parts;
  }

  label(value) {
    return digits(Number(value.toPrecision(6)));
  }

  curve(one) {
    const every = Math.max(1, Math.floor(one.x.length / 900));
    let path = "";
    for (let i = 0; i < one.x.length; i += every) path += `${path ? "L" : "M"}${this.toX(one.x[i]).toFixed(1)} ${this.toY(one.y[i]).toFixed(1)}`;
    return element("path", { d: path, class: `${one.style} ${one.dash ?? ""}` });
  }

  show(time) {
    if (this.inTime) {
      const at = this.toX(time).toFixed(2);
      this.line.setAttribute("x1", at);
      this.line.setAttribute("x2", at);
    }
    this.series.forEach(({ track, x, y }, index) => {
      const value = (values) => values[track.row] + track.share * (values[Math.min(track.row + 1, values.length - 1)] - values[track.row]);
      this.dots[index].setAttribute("cx", this.toX(value(x)).toFixed(2));
      this.dots[index].setAttribute("cy", this.toY(value(y)).toFixed(2));
    });
  }

  look(event, seek) {
    const box = this.cursor.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * Plot.WIDTH;
    const y = ((event.clientY - box.top) / box.height) * Plot.HEIGHT;
    const hits = this.inTime ? this.series.map((one) => nearest(one, (i) => Math.abs(this.toX(one.x[i]) - x))) : [this.nearestCurve(x, y)];
    const time = this.inTime ? Math.max(0, this.fromX(x)) : hits[0].time;
    const values = hits.map(({ one, row }) => `${one.name} ${this.inTime ? "" : `${digits(one.x[row])} rad, `}${digits(one.y[row])} ${this.unit}`);
    this.tip.textContent = [`${time.toFixed(3)} s`, ...values].join("\n");
    this.tip.style.left = x < Plot.WIDTH / 2 ? "auto" : "3.2rem";
    this.tip.style.right = x < Plot.WIDTH / 2 ? ".6rem" : "auto";
    if (event.buttons) seek(time);
  }

  nearestCurve(x, y) {
    const all = this.series.map((one) => nearest(one, (i) => (this.toX(one.x[i]) - x) ** 2 + (this.toY(one.y[i]) - y) ** 2));
    return all.reduce((best, next) => (next.far < best.far ? next : best));
  }
}

function nearest(one, distance) {
  let [row, far] = [0, Infinity];
  for (let i = 0; i < one.x.length; i++) {
    const next = distance(i);
    if (next < far) [row, far] = [i, next];
  }
  return { one, row, far, time: one.track.all.t[row] };
}

function element(name, attributes, text) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

// Start a player, whose views all follow one clock, and return its controls and the picture of the walk.
function play(root, firstScene, firstTracks) {
  const find = (selector) => root.querySelector(selector);
  let [scene, tracks, plots, end, strikes] = [{}, [], [], 0, [0]];
  let [loopEnd, loopStart, lapLength, back] = [0, 0, 0, 0];
  const [walk, foot] = [
    new Picture(find(".walk"), (width) => (width < 500 ? 0.78 : 0.56)),
    new Picture(find(".foot"), (width) => (width < 420 ? 0.8 : 0.4)),
  ];
  const [slider, clock, button] = [find(".time"), find(".clock"), find(".play")];
  let [time, playing, last, frame, colours, close, readout] = [0, false, 0, 0, {}];

  const seek = (next, still = true) => {
    if (still) stop(), (back = 0);
    time = clamp(next, 0, end);
    for (const track of tracks) track.seek(time);
    show();
  };
  // Replace the walks. The clock stays at the same fraction of the same step.
  const change = (newScene, newTracks) => {
    const step = Math.max(0, strikes.findLastIndex((strike) => strike <= time));
    const share = (time - strikes[step]) / (strikes[step + 1] - strikes[step]) || 0;
    [scene, tracks, close] = [newScene, newTracks, newTracks[newTracks.length - 1]];
    tracks.forEach((track) => (track.alone = tracks.length === 1));
    end = Math.max(...tracks.map((track) => track.end));
    strikes = [0, ...close.strikes, end];
    // End and start of the loop (s), and its distance (m); `back` is the distance of all completed loops.
    [loopEnd, loopStart, lapLength] = scene.loop ?? [end, 0, 0];
    if (!lapLength) back = 0;
    const to = Math.min(step, strikes.length - 2);
    slider.max = end;
    plots = makePlots(root, tracks, seek);
    readout = makeReadout(find(".readout"), tracks);
    time = clamp(strikes[to] + share * (strikes[to + 1] - strikes[to]), 0, end);
    for (const track of tracks) track.seek(time);
    if (walk.width) show();
  };

  const show = () => {
    const leg = find(".which").value === "-1" ? close.stance : Number(find(".which").value);
    drawWalk(walk, scene, tracks, colours, back);
    drawFoot(foot, scene, close, leg, colours);
    for (const plot of plots) plot.show(time);
    slider.value = time;
    clock.textContent = `${time.toFixed(2)} s`;
    root.dataset.time = time.toFixed(4);
    if (playing && frame++ % 6) return;
    slider.setAttribute("aria-valuetext", `${time.toFixed(2)} of ${end.toFixed(2)} seconds`);
    find(".foot-values").textContent = describeFoot(close, leg);
    readout();
  };
  const stop = () => {
    playing = false;
    button.textContent = "Play";
  };
  const tick = (now) => {
    if (!playing) return;
    const next = time + (Math.min(now - last, 100) / 1000) * Number(find(".speed").value);
    last = now;
    if (find(".loop").checked && next >= loopEnd) (back += lapLength), seek(next - loopEnd + loopStart, false);
    else if (next < end) seek(next, false);
    else return seek(end);
    requestAnimationFrame(tick);
  };
  const start = () => {
    if (time >= end) seek(0);
    playing = true;
    last = performance.now();
    button.textContent = "Pause";
    requestAnimationFrame(tick);
  };
  const actions = {
    play: () => (playing ? seek(time) : start()),
    "frame-back": () => seek(time - 0.01),
    "frame-on": () => seek(time + 0.01),
    "step-back": () => seek(strikes.findLast((strike) => strike < time - 1e-6) ?? 0),
    "step-on": () => seek(strikes.find((strike) => strike > time + 1e-6) ?? end),
    first: () => seek(0),
    last: () => seek(end),
  };
  const keys = { " ": "play", ArrowLeft: "frame-back", ArrowRight: "frame-on", PageUp: "step-back", PageDown: "step-on", Home: "first", End: "last" };
  root.addEventListener("keydown", (event) => {
    // These controls use the key themselves.
    const reserved = event.key === " " ? "BUTTON INPUT SELECT" : "SELECT";
    const action = keys[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    if (reserved.includes(event.target.tagName) && event.target !== slider) return;
    event.preventDefault();
    actions[action]();
  });
  for (const one of root.querySelectorAll("[data-do]")) one.addEventListener("click", actions[one.dataset.do]);
  slider.addEventListener("input", () => seek(Number(slider.value)));
  find(".which").addEventListener("change", () => show());
  find(".walk").addEventListener("pointermove", (event) => {
    const box = walk.canvas.getBoundingClientRect();
    const far = ({ at: [x, y] }) => Math.hypot(x - event.clientX + box.left, y - event.clientY + box.top);
    const near = walk.points.filter((point) => far(point) < 24);
    find(".scene .tip").textContent = near.map((point) => point.text).join("\n");
  });
  find(".walk").addEventListener("pointerleave", () => (find(".scene .tip").textContent = ""));

  const paint = () => {
    const style = getComputedStyle(root);
    for (const name of ["rigid", "contact", "leg-1", "leg-2", "ground", "ink", "soft", "paper", "force", "bad"]) {
      colours[name] = style.getPropertyValue(`--${name}`).trim();
    }
    show();
  };
  const fit = () => {
    walk.fit();
    foot.fit();
    paint();
  };
  find(".live").hidden = false;
  root.classList.add("scripted");
  // The controls are as wide as the figure, which cannot be observed because it has no box of its own on a phone.
  new ResizeObserver(fit).observe(find(".controls"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  // For users who prefer reduced motion, the walk starts at a quarter of the speed.
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) find(".speed").value = "0.25";
  change(firstScene, firstTracks);
  fit();
  return { change, start, walk };
}

// Read a player's scene and tracks from the page.
const readData = (root) => [
  JSON.parse(root.dataset.player),
  [...root.querySelectorAll(".track")].map(({ dataset }) => new Track(JSON.parse(dataset.meta), dataset.floats)),
];

function makePlots(root, tracks, seek) {
  const view = (name) => root.querySelector(`[data-view=${name}]`);
  for (const old of root.querySelectorAll(".views .sheet")) old.remove();
  const showIf = (name, available) => !(view(name).hidden = !available);
  const sinceStart = (track, name) => Float32Array.from(track.all[name], (value, _, all) => value - track.all[name][0]);
  const series = (track, x, y, label, dash) => ({ track, x, y, name: `${track.name.split(" ")[0].toLowerCase()} ${label}`, style: track.style, dash });
  const plots = [];
  if (showIf("phase", tracks.every((track) => track.has("v0")))) {
    const phase = new Plot(view("phase"), ["angle (rad)", "angular velocity (rad/s)"], "rad/s", false, seek);
    const choice = root.querySelector(".leg");
    const drawPhase = () => {
      const leg = choice.value;
      phase.draw(tracks.map((track) => series(track, track.all[`a${leg}`], track.all[`v${leg}`], "")), `Angular velocity of leg ${Number(leg) + 1} over its angle: closed loops, one for each model`);
    };
    drawPhase();
    choice.onchange = () => {
      drawPhase();
      seek(Number(root.dataset.time));
    };
    plots.push(phase);
  }
  const angles = new Plot(view("angles"), ["time (s)", "angle (rad)"], "rad", true, seek);
  angles.draw(
    tracks.flatMap((track) => [0, 1].map((leg) => series(track, track.all.t, track.all[`a${leg}`], `leg ${leg + 1}`, leg ? "dashed" : ""))),
    "Angles of both legs over time, for each model",
  );
  plots.push(angles);
  const parts = [["ke", "kinetic", ""], ["pe", "potential", "dashed"], ["me", "sum", "dotted"]];
  const with_energy = tracks.filter((track) => track.has("me"));
  if (showIf("energies", with_energy.length)) {
    const energies = new Plot(view("energies"), ["time (s)", "change since the start (J)"], "J", true, seek);
    energies.draw(
      with_energy.flatMap((track) => parts.map(([name, label, dash]) => series(track, track.all.t, sinceStart(track, name), label, dash))),
      "Changes of kinetic and potential energy and of their sum over time, for each model",
    );
    plots.push(energies);
  }
  return plots;
}

// Build the table of each model's values at the current instant, and return the function that updates it.
function makeReadout(table, tracks) {
  const rows = [["a0", "angle of leg 1 (rad)"], ["a1", "angle of leg 2 (rad)"], ["v0", "velocity of leg 1 (rad/s)"], ["v1", "velocity of leg 2 (rad/s)"], ["ke", "kinetic energy (J)"], ["pe", "potential energy (J)"], ["me", "their sum (J)"]].filter(([name]) => tracks.some((track) => track.has(name)));
  for (const part of [table.tHead, table.tBodies[0]]) part.replaceChildren();
  const head = table.tHead.insertRow();
  for (const [index, text] of ["", ...tracks.map((track) => track.name)].entries()) {
    const cell = document.createElement(index ? "th" : "td");
    if (index) cell.scope = "col";
    cell.textContent = text;
    head.append(cell);
  }
  const cells = rows.map(([name, label]) => {
    const row = table.tBodies[0].insertRow();
    const heading = document.createElement("th");
    heading.scope = "row";
    heading.textContent = label;
    row.append(heading);
    return tracks.map((track) => {
      const cell = row.insertCell();
      cell.className = track.style;
      return [track, name, cell];
    });
  });
  return () => {
    for (const [track, name, cell] of cells.flat()) cell.textContent = track.has(name) ? minus(track.at(name).toFixed(4)) : "–";
  };
}

// Show a gait of the diagram in the player, with a button that brings the walk back.
function load(mark, walk) {
  const next = walk.cloneNode(true);
  const [first, ...others] = next.querySelectorAll(".track");
  for (const other of others) other.remove();
  Object.assign(first.dataset, { meta: mark.dataset.meta, floats: mark.dataset.floats });
  next.dataset.player = JSON.stringify({ ...JSON.parse(walk.dataset.player), ...JSON.parse(mark.dataset.gait) });
  next.querySelector(".loop").checked = true;
  const [key, back] = [next.querySelector(".key"), document.createElement("button")];
  key.replaceChildren(Object.assign(document.createElement("li"), { className: "rigid", textContent: mark.getAttribute("aria-label") }));
  Object.assign(back, { type: "button", className: "back", textContent: "Back to the walk" });
  back.addEventListener("click", () => begin(next, walk.cloneNode(true)));
  key.after(back);
  begin(document.querySelector("[data-player]"), next);
}

function begin(old, next) {
  old.replaceWith(next);
  play(next, ...readData(next));
  next.focus();
  next.scrollIntoView({ block: "nearest" });
}

const pristine = document.querySelector("[data-player]")?.cloneNode(true);
for (const root of document.querySelectorAll("[data-player]")) play(root, ...readData(root));
for (const diagram of document.querySelectorAll(".diagram")) {
  const marks = [...diagram.querySelectorAll("[data-gait]")];
  for (const [index, mark] of marks.entries()) {
    mark.addEventListener("click", () => pristine && load(mark, pristine));
    mark.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === " ") mark.dispatchEvent(new Event("click"));
      const to = marks[index + { ArrowRight: 1, ArrowLeft: -1 }[event.key]];
      if (to) {
        mark.tabIndex = -1;
        to.tabIndex = 0;
        to.focus();
      }
      if (to || event.key === "Enter" || event.key === " ") event.preventDefault();
    });
  }
}
