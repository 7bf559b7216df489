const token = new URLSearchParams(location.search).get("token");
const byId = (id) => document.getElementById(id);
const MODELS = { rigid: "simulate", contact: "contact-sim" };

// Requested config: its name (empty for the initial one) and the changes to it.
let state = { config: "", set: {} };
let rows = new Map();
let touched = "slope_deg";
let shown = null;
let player = null;

async function ask(path, body) {
  const options = { headers: { Authorization: `Bearer ${token}` } };
  if (body) Object.assign(options, { method: "POST", body: JSON.stringify(body) });
  const answer = await fetch(path, options);
  return [answer.status, await answer.json()];
}

const requestBody = (more = {}) => ({ ...(state.config && { config: state.config }), set: state.set, ...more });
const labelOf = (config = "") => [...byId("config").options].find((option) => option.value === config).text;
const models = () => Object.keys(MODELS).filter((model) => byId(model).checked);
const describeChanges = (set) => Object.entries(set).map(([key, value]) => `${key} ${typeof value === "string" ? value : typeof value === "number" ? digits(value, 6) : JSON.stringify(value)}`).join(", ");

// The address

function fragment() {
  const values = Object.fromEntries(Object.entries(state.set).map(([key, value]) => [key, JSON.stringify(value)]));
  return `#${new URLSearchParams({ ...(state.config && { config: state.config }), ...values })}`;
}

function valueOf(text) {
  try {
    return JSON.parse(text);
  } catch {
    return Number.isFinite(Number(text)) && text.trim() ? Number(text) : text;
  }
}

function fromFragment() {
  const parameters = [...new URLSearchParams(location.hash.slice(1))].filter(([, text]) => text);
  const { config = "", ...set } = Object.fromEntries(parameters);
  const known = [...byId("config").options].some((option) => option.value === config);
  state = { config: known ? config : "", set: Object.fromEntries(Object.entries(set).map(([key, text]) => [key, valueOf(text)])) };
  byId("config").value = state.config;
}

// Called only when a slider is released, because the Back button would be useless if the history had every value on the way.
function remember() {
  if (fragment() !== remember.last) history.pushState(null, "", fragment());
  remember.last = fragment();
}

// Requests are sent one at a time. While one is being answered, only the newest of the others is kept.

let busy = false;
let pending = false;

async function walk() {
  pending = true;
  if (busy) return;
  busy = true;
  while (pending) {
    pending = false;
    document.body.dataset.state = "asking";
    const request = structuredClone(requestBody({ models: models() }));
    const began = performance.now();
    const timer = setInterval(() => {
      say(`Computing ${describeChanges(request.set) || labelOf(request.config)} (${Math.round((performance.now() - began) / 1000)} s).`);
    }, 500);
    try {
      const [status, answer] = await ask("/api/walk", request).finally(() => clearInterval(timer));
      // A newer request, perhaps of another page, has displaced this one: send it again.
      if (status === 409) pending = true;
      if (!pending) show(status, answer, request);
    } catch {
      document.body.dataset.state = "failed";
      say("The server does not answer. Start `walkerlab explore` again; this page keeps trying.", "bad");
      await new Promise((resolve) => setTimeout(resolve, 1000));
      pending = true;
    }
  }
  busy = false;
}

// Text between backticks is shown as code.
function say(text, tone = "plain") {
  byId("message").replaceChildren(...text.split("`").map((part, index) => (index % 2 ? Object.assign(document.createElement("code"), { textContent: part }) : part)));
  byId("message").className = `statement ${tone}`;
}

const asSentence = (text = "") => text && (/^[a-z]+[ :]/.test(text) ? text[0].toUpperCase() : text[0]) + text.slice(1) + (/[.:]$/.test(text) ? "" : ".");
// The position in a command line or file, with which an error begins, means nothing on a page.
const withoutPosition = (text) => text.replace(/^(--set .*?|\S.*?:\d+:\d+): /, "");
const sentence = ({ message, advice }) => [withoutPosition(message), advice].map(asSentence).join(" ").trim();

function show(status, answer, request) {
  for (const row of rows.values()) row.root.classList.remove("wrong");
  const gait = answer.fixedpoint;
  if (status !== 200 || gait.error) {
    document.body.dataset.state = "failed";
    say(sentence(gait?.error ?? answer.error), "bad");
    if (status === 422) rows.get(answer.error.key)?.root.classList.add("wrong");
    if (status !== 200) return;
  }
  shown = { answer, request };
  document.body.dataset.shown = "";
  const title = [labelOf(request.config), describeChanges(request.set)].filter(Boolean).join(" with ");
  byId("shown").textContent = `${answer.tracks ? "Shown" : "No walk"}: ${title}`;
  byId("command").textContent = answer.command;
  showPlayer(!!answer.tracks);
  fillTable(answer);
  drawCircle(gait.multipliers ?? []);
  along.mark();
  if (gait.error) return;
  document.body.dataset.state = "shown";
  const walks = Object.entries(MODELS).filter(([, stage]) => answer[stage]);
  const ends = walks.map(([model, stage]) => `${model === "rigid" ? "Rigid" : "Contact"} model: ${outcome(answer[stage])}`);
  const fine = gait.stable && walks.every(([, stage]) => answer[stage].outcome === "walked");
  say([`${gait.stable ? "A stable" : "An unstable"} gait.`, ...ends, ...answer.warnings.map((text) => sentence({ message: text }))].join(" "), fine ? "good" : "fair");
  draw();
}

const ENDS = { walked: "walks", fell: "falls", slid: "slides" };
const outcome = (walk) => (walk.error ? sentence(walk.error) : walk.outcome === "walked" ? `walks ${walk.steps} steps.` : `${ENDS[walk.outcome] ?? walk.outcome} in step ${walk.steps + 1}: ${walk.advice}`);

// The circle and the table stay visible without a walk.
function showPlayer(walks) {
  for (const part of byId("stage").querySelectorAll(".scenes, .controls, .views, .readout, .key, .player > figcaption")) part.hidden = !walks;
}

// End (s), start (s) and length (m) of a walk's last two steps, which a steady walk repeats.
function lastLap(track) {
  const strikes = [0, ...track.strikes];
  const last = 2 * Math.floor(track.strikes.length / 2);
  const hip = (time) => (track.seek(time), track.at("hx"));
  return last ? [strikes[last], strikes[last - 2], hip(strikes[last]) - hip(strikes[last - 2])] : undefined;
}

function draw() {
  const { answer } = shown;
  if (!answer.tracks) return;
  const stages = models().map((model) => MODELS[model]).filter((stage) => answer.tracks[stage]);
  showPlayer(stages.length > 0);
  if (!stages.length) return;
  const tracks = stages.map((stage) => new Track(answer.tracks[stage].meta, answer.tracks[stage].floats));
  const scene = { ...answer.scene, loop: stages.every((stage) => answer[stage].outcome === "walked") ? lastLap(tracks.at(-1)) : undefined };
  if (player) return player.change(scene, tracks);
  byId("stage").append(byId("player").content.cloneNode(true));
  const root = byId("stage").firstElementChild;
  root.querySelector(".loop").checked = true;
  root.querySelector(".views").before(byId("results").parentElement);
  player = play(root, scene, tracks);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player.start();
}

// Table of results

const ROWS = [
  ["step period of the gait (s)", (gait, walk, first) => first && gait.period_s],
  ["step length of the gait (m)", (gait, walk, first) => first && gait.step_length_m],
  ["speed of the gait (m/s)", (gait, walk, first) => first && gait.step_length_m / gait.period_s],
  ["largest multiplier", (gait, walk, first) => first && gait.spectral_radius],
  ["cost of transport", (gait, walk) => walk?.cost_of_transport],
  ["last step's period (s)", (gait, walk) => walk?.step_periods_s?.at(-1)],
  ["last step's length (m)", (gait, walk) => walk?.step_lengths_m?.at(-1)],
  ["steps", (gait, walk) => walk?.steps],
];

function fillTable(answer) {
  const tableRows = ROWS.map(([name, valueOfWalk]) => {
    const row = document.createElement("tr");
    row.append(Object.assign(document.createElement("th"), { scope: "row", textContent: name }));
    Object.values(MODELS).forEach((stage, index) => {
      const value = valueOfWalk(answer.fixedpoint, answer[stage], index === 0);
      row.append(Object.assign(document.createElement("td"), { className: "n", textContent: Number.isFinite(value) ? digits(value, 6) : "–" }));
    });
    return row;
  });
  byId("results").tBodies[0].replaceChildren(...tableRows);
}

const trail = [];

function drawCircle(multipliers) {
  if (multipliers.length) trail.push(multipliers);
  if (trail.length > 80) trail.shift();
  const reach = Math.max(1.25, Math.min(4, 1.15 * Math.max(0, ...multipliers.map(([real, imaginary]) => Math.hypot(real, imaginary)))));
  const at = ([real, imaginary], style) => element("circle", { cx: clamp(real, -reach, reach), cy: -clamp(imaginary, -reach, reach), r: (style === "then" ? 0.02 : 0.04) * reach, class: style });
  const svg = byId("circle");
  svg.setAttribute("viewBox", `${-reach} ${-reach} ${2 * reach} ${2 * reach}`);
  const rim = element("circle", { r: 1, class: "rim", "stroke-width": 0.01 * reach });
  const axes = [{ x1: -reach, x2: reach }, { y1: -reach, y2: reach }].map((ends) => element("line", { ...ends, class: "axis", "stroke-width": 0.006 * reach }));
  const now = multipliers.map((one) => at(one, Math.hypot(...one) < 1 ? "now" : "now out"));
  svg.replaceChildren(...axes, rim, ...trail.slice(0, -1).flat().map((one) => at(one, "then")), ...now);
  const labels = multipliers.map(([real, imaginary]) => digits(real, 4) + (imaginary ? ` ${imaginary < 0 ? "−" : "+"} ${digits(Math.abs(imaginary), 4)} i` : ""));
  svg.setAttribute("aria-label", `Multipliers in the unit circle: ${labels.join(", ") || "none"}`);
}

// Parameters

class Row {
  constructor(number) {
    this.number = number;
    this.root = document.createElement("div");
    this.root.className = "turn";
    const id = `turn-${number.key}`;
    const label = Object.assign(document.createElement("label"), { htmlFor: id, title: `${number.meaning}${number.bounds ? `; ${number.bounds}` : ""}` });
    const name = Object.assign(document.createElement("span"), { textContent: number.key.replace(/^(walker|contact)\./, "").replace(/[._]/g, "$&\u200b") });
    label.append(name, " ", Object.assign(document.createElement("small"), { textContent: number.unit === "1" ? "" : number.unit.replaceAll("^2", "²") }));
    const reset = Object.assign(document.createElement("button"), { type: "button", textContent: "↺", title: `Back to ${JSON.stringify(number.start)}`, ariaLabel: `Reset ${number.key}` });
    reset.addEventListener("click", () => setParameter(number.key, number.start, true));
    const inputs = number.words ? [this.makeChoice(id)] : "from" in number ? [this.makeSlider(id), this.makeField()] : [this.makeField(id)];
    this.root.append(label, ...inputs, reset);
    this.put(number.value);
  }
  makeChoice(id) {
    this.select = Object.assign(document.createElement("select"), { id });
    for (const word of this.number.words) this.select.append(new Option(word));
    this.select.addEventListener("change", () => setParameter(this.number.key, this.number.words[this.select.selectedIndex], true));
    return this.select;
  }
  makeSlider(id) {
    this.range = Object.assign(document.createElement("input"), { type: "range", id, min: 0, max: 1000, step: "any" });
    this.range.addEventListener("input", () => setParameter(this.number.key, this.fromRange(), false));
    this.range.addEventListener("change", () => setParameter(this.number.key, this.fromRange(), true));
    const arrow = (event) => {
      const way = { ArrowRight: 10, ArrowUp: 10, ArrowLeft: -10, ArrowDown: -10 }[event.key];
      if (!way) return;
      event.preventDefault();
      if (event.type === "keydown") this.range.value = Number(this.range.value) + way;
      setParameter(this.number.key, this.fromRange(), event.type === "keyup");
    };
    for (const kind of ["keydown", "keyup"]) this.range.addEventListener(kind, arrow);
    return this.range;
  }
  makeField(id) {
    this.text = Object.assign(document.createElement("input"), { className: "typed", spellcheck: false, autocomplete: "off" });
    if (id) this.text.id = id;
    else Object.assign(this.text, { inputMode: "decimal", ariaLabel: `${this.number.key}, value` });
    this.text.addEventListener("change", () => {
      const text = this.text.value.trim().replace("−", "-");
      setParameter(this.number.key, text ? valueOf(text) : this.number.start, true);
    });
    return this.text;
  }
  fromRange() {
    const { from, to, log, whole } = this.number;
    const share = Number(this.range.value) / 1000;
    const value = log ? from * (to / from) ** share : from + share * (to - from);
    return whole ? Math.round(value) : Number(value.toPrecision(4));
  }
  put(value) {
    const { from, to, log, start: first } = this.number;
    this.root.classList.toggle("changed", JSON.stringify(value) !== JSON.stringify(first));
    if (this.select) return (this.select.value = String(value));
    if (this.range && typeof value === "number") this.range.value = 1000 * (log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from));
    this.range?.setAttribute("aria-valuetext", `${value} ${this.number.unit}`);
    const text = typeof value === "number" ? String(Number(value.toPrecision(7))) : typeof value === "string" ? value : JSON.stringify(value);
    if (document.activeElement !== this.text || Number(this.text.value) !== value) this.text.value = text;
    this.written = this.text.value;
  }
  // Keep typed text that is not entered yet, even if an answer arrives meanwhile.
  get edited() {
    return this.text && this.text.value !== this.written;
  }
}

function setParameter(key, value, released) {
  const row = rows.get(key);
  if (JSON.stringify(value) === JSON.stringify(row.number.start)) delete state.set[key];
  else state.set[key] = value;
  row.put(value);
  if (row.number.gaits) touched = key;
  walk();
  if (released) remember(), refreshParameters();
  else along.mark();
}

// Other values may depend on the changed one. Ignore answers for values that have changed again.
async function refreshParameters() {
  const requested = fragment();
  const [status, answer] = await ask("/api/numbers", requestBody()).catch(() => [0]);
  if (fragment() !== requested) return;
  if (status === 200) arrange(answer.numbers);
  along.draw();
}

function arrange(numbers) {
  const focused = document.activeElement?.id;
  const pinned = new Set([...rows.values()].filter((row) => row.pinned).map((row) => row.number.key));
  const before = rows;
  rows = new Map();
  for (const number of numbers) {
    const old = before.get(number.key);
    const same = old && old.number.start === number.start && "from" in old.number === "from" in number;
    const row = same ? Object.assign(old, { number }) : new Row(number);
    // Rows chosen in the search stay visible, and so do changed rows that are otherwise found only by the search.
    row.pinned = pinned.has(number.key) || (number.rank === null && number.key in state.set);
    if (!row.edited) row.put(state.set[number.key] ?? number.value);
    rows.set(number.key, row);
  }
  const visible = [...rows.values()].filter(({ number, pinned }) => number.rank !== null || pinned);
  visible.sort((one, other) => (one.number.rank ?? Infinity) - (other.number.rank ?? Infinity) || 0);
  document.body.classList.toggle("rigid-only", !rows.has("contact.stiffness"));
  const elements = visible.map((row) => row.root);
  const current = [...byId("sliders").children];
  // Moving a slider in the page would end its drag, so leave the list alone unless it differs.
  if (elements.length !== current.length || elements.some((one, index) => one !== current[index])) {
    byId("sliders").replaceChildren(...elements);
    if (focused) byId(focused)?.focus();
  }
}

function search() {
  const words = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const hits = words.length ? [...rows.values()].filter(({ number }) => words.every((word) => `${number.key} ${number.meaning} ${number.unit}`.toLowerCase().includes(word))) : [];
  byId("matches").replaceChildren(...hits.map((row) => {
    const { key, unit, meaning, bounds } = row.number;
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: `${key}${unit && unit !== "1" ? ` (${unit})` : ""}: ${meaning}${bounds ? `; ${bounds}` : ""}` });
    button.addEventListener("click", () => {
      row.pinned = true;
      arrange([...rows.values()].map(({ number }) => number));
      (row.range ?? row.select ?? row.text).focus();
    });
    return button;
  }));
  if (words.length && !hits.length) byId("matches").textContent = "No key of this walker matches these words.";
}

// Gaits over the parameter changed last

class Along extends Plot {
  constructor(container) {
    super(container, ["", ""], "", true, () => {});
    this.curves_of = {};
    this.cursor.addEventListener("pointerup", (event) => {
      const [low, high] = [this.fromX(Plot.FRAME[0]), this.fromX(Plot.WIDTH - Plot.FRAME[2])];
      if (this.series) setParameter(this.key, Number(this.value(clamp(this.at(event), low, high)).toPrecision(4)), true);
    });
  }
  // Values that span decades are plotted on a logarithmic axis.
  scaled(value) {
    return this.log ? Math.log10(value) : value;
  }
  value(scaled) {
    return this.log ? 10 ** scaled : scaled;
  }
  label(value, horizontal) {
    if (!horizontal || !this.log) return super.label(value);
    return Number.isInteger(value) ? (Math.abs(value) < 4 ? digits(10 ** value) : minus(`1e${value}`)) : "";
  }
  at(event) {
    const box = this.cursor.getBoundingClientRect();
    return this.fromX(((event.clientX - box.left) / box.width) * Plot.WIDTH);
  }
  look(event) {
    if (this.series) this.tip.textContent = `${digits(this.value(this.at(event)), 4)} ${rows.get(this.key)?.number.unit ?? ""}`;
  }
  // Draw coarse curves first, then finer ones unless something else is requested.
  async draw() {
    const row = [rows.get(touched), rows.get("slope_deg")].find((one) => one?.number.gaits);
    if (!row) return;
    const { key, from, to, log, unit } = row.number;
    const { [key]: current, ...others } = state.set;
    const drawn = models().filter((model) => model === "rigid" ? !key.startsWith("contact.") : rows.has("contact.stiffness"));
    const request = JSON.stringify([state.config, others, key, drawn]);
    byId("along-title").textContent = `Along ${key}`;
    if (request === this.request) return this.mark();
    if (key !== this.key) {
      this.series = this.gaits = null;
      for (const layer of [this.curves, this.cursor]) layer.replaceChildren();
    }
    this.request = request;
    this.key = key;
    this.unit = unit;
    this.log = log && to > 50 * from;
    this.container.classList.add("old");
    this.showStatus("Computing …");
    const curves = {};
    let error = "";
    const passes = [["rigid", 12], ["rigid", 60], ["contact", 8], ["contact", 40]].filter(([model]) => drawn.includes(model));
    for (const [index, [model, points]] of passes.entries()) {
      const span = { over: key, from: from || 1e-9, to, points, model, periods: 1 };
      const block = Object.fromEntries(Object.entries(span).map(([name, value]) => [`continuation.${name}`, value]));
      const [status, answer] = await ask("/api/along", requestBody({ set: { ...state.set, ...block } })).catch(() => [0]);
      if (this.request !== request) return;
      if (status === 409) return this.showStatus("Superseded by another page's request."), (this.request = null);
      if (status === 200) curves[model] = answer.curves;
      else if (status === 422) error = sentence(answer.error);
      this.gaits = Object.values(curves).flat();
      if (this.gaits.length) this.plot();
      const more = index + 1 < passes.length ? ` Refining the ${passes[index + 1][0]} model's curve.` : "";
      this.showStatus((this.gaits.length ? "Solid lines are stable; click to jump there." : more ? "" : error || "No gaits found along this parameter.") + more);
    }
  }
  showStatus(text) {
    byId("along-status").textContent = text;
  }
  plot() {
    if (!this.gaits?.length) return;
    this.container.classList.remove("old");
    const quantity = byId("quantity");
    this.titles = [this.unit && this.unit !== "1" ? `${this.key} (${this.unit})` : this.key, ""];
    // If the axis included gaits far from the stable ones, the others would look like a line.
    const typical = [this.height, ...this.gaits.flatMap((curve) => curve[quantity.value].filter((_, index) => curve.stable[index]))].filter(Number.isFinite);
    const [low, high] = typical.length ? [Math.min(...typical) / 1.5, Math.max(...typical) * 1.5] : [0, Infinity];
    const series = this.gaits.flatMap((curve) => {
      const pieces = [];
      curve.value.forEach((x, index) => {
        const y = curve[quantity.value][index];
        if (y < low || y > high) return pieces.push(null);
        const last = pieces.at(-1);
        if (last) last.x.push(this.scaled(x)), last.y.push(y);
        if (last?.stable !== curve.stable[index]) {
          pieces.push({ x: [this.scaled(x)], y: [y], stable: curve.stable[index], style: curve.model, dash: curve.stable[index] ? "" : "dashed" });
        }
      });
      return pieces.filter((piece) => piece);
    });
    if (!series.length) return;
    super.draw(series, `${quantity.selectedOptions[0].text} of gaits over ${this.key}`);
    this.dot = element("circle", { r: 4.5 });
    this.cursor.replaceChildren(this.line, this.dot);
    this.mark();
  }
  // Plotted quantity of the gait shown, or undefined if only the contact model's curves are plotted.
  get height() {
    const gait = shown?.answer.fixedpoint ?? {};
    const quantity = byId("quantity").value;
    if (!this.gaits?.some(({ model }) => model === "rigid")) return undefined;
    return quantity === "speed_m_s" ? gait.step_length_m / gait.period_s : gait[quantity];
  }
  mark() {
    if (!this.series || !shown) return;
    const value = state.set[this.key] ?? rows.get(this.key)?.number.value;
    const [x, y] = [this.toX(this.scaled(value)), this.toY(this.height)];
    this.line.setAttribute("visibility", Number.isFinite(x) ? "visible" : "hidden");
    this.dot.setAttribute("visibility", Number.isFinite(x + y) ? "visible" : "hidden");
    if (Number.isFinite(x)) for (const name of ["x1", "x2"]) this.line.setAttribute(name, x);
    if (Number.isFinite(x + y)) for (const [name, at] of [["cx", x], ["cy", clamp(y, 0, Plot.HEIGHT)]]) this.dot.setAttribute(name, at);
  }
}

// Exports

function download(name, address) {
  Object.assign(document.createElement("a"), { download: name, href: address }).click();
}

// The canvas is transparent, so fill in the background of the page.
function savePicture() {
  if (!player) return;
  const { canvas } = player.walk;
  const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
  const context = copy.getContext("2d");
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, copy.width, copy.height);
  context.drawImage(canvas, 0, 0);
  download("walk.png", copy.toDataURL("image/png"));
}

function showExport(text, url) {
  byId("export-status").textContent = `${text} `;
  if (url) byId("export-status").append(Object.assign(document.createElement("a"), { href: `${url}?token=${token}`, textContent: "Open", target: "_blank" }));
}

async function save() {
  const [status, answer] = await ask("/api/save", requestBody({ name: byId("name").value })).catch(() => [0]);
  showExport(status === 200 ? `Saved: ${answer.file}` : status ? sentence(answer.error) : "The server does not answer.");
  const name = answer?.file?.split("/").at(-1);
  if (name && ![...byId("config").options].some((option) => option.value === name)) byId("config").append(new Option(name));
}

const LABELS = { gif: "GIF", report: "Report" };

async function exportAs(kind) {
  let [status, answer] = await ask("/api/job", requestBody({ kind, models: models() })).catch(() => [0]);
  while (status === 200 && answer.running) {
    showExport(`${kind}: ${answer.progress || "starting"}`, answer.url);
    await new Promise((resolve) => setTimeout(resolve, 500));
    [status, answer] = await ask("/api/job").catch(() => [0]);
  }
  if (status !== 200) return showExport(status ? sentence(answer.error) : "The server does not answer.");
  showExport(answer.error ? sentence(answer.error) : `${LABELS[kind]} ready.`, answer.url);
}

// The whole page

async function begin() {
  fromFragment();
  remember.last = fragment();
  let [status, answer] = await ask("/api/numbers", requestBody()).catch(() => [0]);
  if (status === 422) [status, answer] = await ask("/api/numbers", { ...requestBody(), set: {} });
  if (status === 200) arrange(answer.numbers);
  else say(status ? sentence(answer.error) : "The server does not answer.", "bad");
  await walk();
  along.draw();
}

function choose(config) {
  state = { config, set: {} };
  [rows, touched] = [new Map(), "slope_deg"];
  trail.length = 0;
  remember();
  begin();
}

const along = new Along(document.querySelector("#along .view"));
byId("config").addEventListener("change", () => choose(byId("config").value));
byId("reset").addEventListener("click", () => choose(state.config));
byId("search").addEventListener("input", search);
byId("search").addEventListener("keydown", ({ key }) => {
  const hits = byId("matches").children;
  if (key === "Enter" && hits.length === 1) hits[0].click();
});
byId("quantity").addEventListener("change", () => along.plot());
for (const model of Object.keys(MODELS)) {
  byId(model).addEventListener("change", () => {
    if (byId(model).checked) walk();
    else if (shown) draw();
    along.draw();
  });
}
byId("copy").addEventListener("click", () => navigator.clipboard.writeText(byId("command").textContent).then(() => showExport("Copied.")));
byId("save").addEventListener("click", save);
byId("png").addEventListener("click", savePicture);
for (const kind of ["gif", "report"]) byId(kind).addEventListener("click", () => exportAs(kind));
addEventListener("popstate", begin);
// The link must not replace the fragment, which holds the changes.
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault();
  byId("config").focus();
});
begin();
