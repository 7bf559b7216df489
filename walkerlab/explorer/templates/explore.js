const token = new URLSearchParams(location.search).get("token");
const byId = (id) => document.getElementById(id);
const MODELS = { rigid: "simulate", contact: "contact-sim" };
const start = byId("config").value;

// What is asked about: the config's name and what differs from it, as the address has it.
let state = { config: start, set: {} };
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

const question = (more = {}) => ({ config: state.config, set: state.set, ...more });
const models = () => Object.keys(MODELS).filter((model) => byId(model).checked);
const changes = (set) => Object.entries(set).map(([key, value]) => `${key} ${typeof value === "number" ? digits(value, 6) : value}`).join(", ");

// The address

function fragment() {
  const said = Object.fromEntries(Object.entries(state.set).map(([key, value]) => [key, JSON.stringify(value)]));
  return `#${new URLSearchParams({ ...(state.config === start ? {} : { config: state.config }), ...said })}`;
}

function fromFragment() {
  const { config = start, ...set } = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  const value = (text) => {
    try {
      return JSON.parse(text);
    } catch {
      return text;
    }
  };
  const known = [...byId("config").options].some((option) => option.value === config);
  state = { config: known ? config : start, set: Object.fromEntries(Object.entries(set).map(([key, text]) => [key, value(text)])) };
  byId("config").value = state.config;
}

// A number that is let go is a place to come back to; one that is still being turned is not.
function remember() {
  if (fragment() !== remember.last) history.pushState(null, "", fragment());
  remember.last = fragment();
}

// Asking: one question at a time; of those that come meanwhile, the last.

let [asking, next] = [false, false];

async function walk() {
  next = true;
  if (asking) return;
  asking = true;
  while (next) {
    next = false;
    document.body.dataset.state = "asking";
    const asked = structuredClone(question({ models: models() }));
    const began = performance.now();
    const late = setInterval(() => {
      const once = shown ? "" : " The kernels are loaded; where they have to be compiled first, that takes some twenty seconds, once.";
      say(`Computing ${changes(asked.set) || asked.config}: ${Math.round((performance.now() - began) / 1000)} s.${once}`);
    }, 500);
    try {
      const [status, answer] = await ask("/api/walk", asked);
      clearInterval(late);
      if (!next) show(status, answer, asked);
    } catch {
      clearInterval(late);
      document.body.dataset.state = "failed";
      say("The server does not answer. Start `walkerlab explore` again; this page goes on asking.", "bad");
      await new Promise((resolve) => setTimeout(resolve, 1000));
      next = true;
    }
  }
  asking = false;
}

function say(text, tone = "plain") {
  byId("said").textContent = text;
  byId("said").className = `statement ${tone}`;
}

const sentence = ({ message, advice }) => `${message} ${advice ?? ""}`.trim();

function show(status, answer, asked) {
  for (const row of rows.values()) row.place.classList.remove("wrong");
  const gait = answer.fixedpoint;
  if (status !== 200 || gait.error) {
    document.body.dataset.state = "failed";
    say(status === 200 ? `No gait: ${sentence(gait.error)}` : sentence(answer.error), "bad");
    if (status === 422) rows.get(answer.error.key)?.place.classList.add("wrong");
    if (status !== 200) return;
  }
  shown = { answer, asked };
  const named = [asked.config, changes(asked.set)].filter(Boolean).join(" with ");
  byId("shown").textContent = `${answer.tracks ? "Shown" : "Nothing walks"}: ${named}`;
  byId("command").textContent = answer.command;
  byId("place").hidden = !answer.tracks;
  fillTable(answer);
  drawCircle(gait.multipliers ?? []);
  along.mark();
  if (gait.error) return;
  document.body.dataset.state = "shown";
  const stable = gait.stable ? "a stable gait" : "an unstable gait";
  const ends = Object.entries(MODELS).filter(([, stage]) => answer[stage]).map(([model, stage]) => `${model}: ${outcome(answer[stage])}`);
  say([stable, ...ends, ...answer.warnings].join("; "), ends.every((text) => text.includes("walked")) && gait.stable ? "good" : "fair");
  draw();
}

const outcome = (walk) => (walk.error ? sentence(walk.error) : `${walk.outcome} ${walk.outcome === "walked" ? `${walk.steps} steps` : `in step ${walk.steps + 1}. ${walk.advice}`}`);

function draw() {
  const { answer } = shown;
  if (!answer.tracks) return;
  const stages = models().map((model) => MODELS[model]).filter((stage) => answer.tracks[stage]);
  byId("place").hidden = stages.length === 0;
  if (!stages.length) return;
  const tracks = stages.map((stage) => new Track(answer.tracks[stage].meta, answer.tracks[stage].floats));
  const scene = { ...answer.scene, repeats: stages.every((stage) => answer[stage].outcome === "walked") };
  if (player) return player.change(scene, tracks);
  byId("place").append(byId("player").content.cloneNode(true));
  const root = byId("place").firstElementChild;
  root.querySelector(".loop").checked = true;
  player = play(root, scene, tracks);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player.start();
}

// What the walks come to

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
  const cells = ROWS.map(([name, of]) => {
    const row = document.createElement("tr");
    row.append(Object.assign(document.createElement("th"), { scope: "row", textContent: name }));
    Object.values(MODELS).forEach((stage, index) => {
      const value = of(answer.fixedpoint, answer[stage], index === 0);
      row.append(Object.assign(document.createElement("td"), { className: "n", textContent: Number.isFinite(value) ? digits(value, 6) : "–" }));
    });
    return row;
  });
  byId("results").tBodies[0].replaceChildren(...cells);
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
  const said = multipliers.map(([real, imaginary]) => digits(real, 4) + (imaginary ? ` ${imaginary < 0 ? "−" : "+"} ${digits(Math.abs(imaginary), 4)} i` : ""));
  svg.setAttribute("aria-label", `Multipliers in the unit circle: ${said.join(", ") || "none"}`);
}

// The numbers

class Row {
  constructor(number) {
    this.number = number;
    this.place = document.createElement("div");
    this.place.className = "turn";
    const id = `turn-${number.key}`;
    const label = Object.assign(document.createElement("label"), { htmlFor: id, title: `${number.meaning}${number.bounds ? `; ${number.bounds}` : ""}` });
    const name = Object.assign(document.createElement("span"), { textContent: number.key.replace(/^(walker|contact)\./, "") });
    label.append(name, " ", Object.assign(document.createElement("small"), { textContent: number.unit === "1" ? "" : number.unit }));
    const back = Object.assign(document.createElement("button"), { type: "button", textContent: "↺", title: `Back to ${number.start}`, ariaLabel: `Reset ${number.key}` });
    back.addEventListener("click", () => turn(number.key, number.start, true));
    const inputs = number.words ? [this.choice(id)] : [this.slider(id), this.typed(id)];
    this.place.append(label, ...inputs, back);
    this.put(number.value);
  }
  choice(id) {
    this.select = Object.assign(document.createElement("select"), { id });
    for (const word of this.number.words) this.select.append(new Option(word));
    this.select.style.gridColumn = "2 / span 2";
    this.select.addEventListener("change", () => turn(this.number.key, this.number.words[this.select.selectedIndex], true));
    return this.select;
  }
  slider(id) {
    this.range = Object.assign(document.createElement("input"), { type: "range", id, min: 0, max: 1000, step: "any" });
    this.range.addEventListener("input", () => turn(this.number.key, this.fromRange(), false));
    this.range.addEventListener("change", () => turn(this.number.key, this.fromRange(), true));
    this.range.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (!way) return;
      event.preventDefault();
      this.range.value = Number(this.range.value) + 10 * way;
      turn(this.number.key, this.fromRange(), true);
    });
    return this.range;
  }
  typed(id) {
    this.text = Object.assign(document.createElement("input"), { className: "typed", inputMode: "decimal", ariaLabel: `${this.number.key}, typed` });
    this.text.addEventListener("change", () => {
      const value = Number(this.text.value.replace("−", "-"));
      turn(this.number.key, this.text.value.trim() && Number.isFinite(value) ? value : this.text.value, true);
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
    this.place.classList.toggle("changed", value !== first);
    if (this.select) return (this.select.value = String(value));
    if (typeof value === "number") this.range.value = 1000 * (log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from));
    this.range.setAttribute("aria-valuetext", `${value} ${this.number.unit}`);
    if (document.activeElement !== this.text || Number(this.text.value) !== value) this.text.value = typeof value === "number" ? String(Number(value.toPrecision(7))) : value;
  }
}

function turn(key, value, settled) {
  const row = rows.get(key);
  if (value === row.number.start) delete state.set[key];
  else state.set[key] = value;
  row.put(value);
  if (typeof value === "number") touched = key;
  walk();
  if (settled) remember(), settle();
  else along.mark();
}

// Other values may follow from the one that was turned.
async function settle() {
  const [status, answer] = await ask("/api/numbers", question()).catch(() => [0]);
  if (status === 200) arrange(answer.numbers);
  along.draw();
}

function arrange(numbers) {
  const focused = document.activeElement?.id;
  const asked = new Set([...rows.values()].filter((row) => row.wanted).map((row) => row.number.key));
  const before = rows;
  rows = new Map();
  for (const number of numbers) {
    const old = before.get(number.key);
    const same = old && old.number.start === number.start && old.number.from === number.from && old.number.to === number.to;
    const row = same ? old : new Row(number);
    row.wanted = asked.has(number.key) || (number.rank === null && number.key in state.set);
    row.put(state.set[number.key] ?? number.value);
    rows.set(number.key, row);
  }
  const seen = [...rows.values()].filter(({ number, wanted }) => number.rank !== null || wanted);
  seen.sort((one, other) => (one.number.rank ?? Infinity) - (other.number.rank ?? Infinity) || 0);
  const places = seen.map((row) => row.place);
  const there = [...byId("sliders").children];
  if (places.length !== there.length || places.some((place, index) => place !== there[index])) {
    byId("sliders").replaceChildren(...places);
    if (focused) byId(focused)?.focus();
  }
}

function search() {
  const words = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const hits = words.length ? [...rows.values()].filter(({ number }) => words.every((word) => `${number.key} ${number.meaning} ${number.unit}`.toLowerCase().includes(word))) : [];
  byId("found").replaceChildren(...hits.map((row) => {
    const { key, unit, meaning, bounds } = row.number;
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: `${key}${unit && unit !== "1" ? ` (${unit})` : ""}: ${meaning}${bounds ? `; ${bounds}` : ""}` });
    button.addEventListener("click", () => {
      row.wanted = true;
      arrange([...rows.values()].map(({ number }) => number));
      (row.range ?? row.select).focus();
    });
    return button;
  }));
  if (words.length && !hits.length) byId("found").textContent = "No key of this walker has these words in its name, unit or meaning.";
}

// Gaits over the number that was turned last

class Along extends Plot {
  constructor(place) {
    super(place, ["", ""], "", true, () => {});
    this.curves_of = {};
    this.cursor.addEventListener("pointerup", (event) => {
      const [least, most] = [this.fromX(Plot.FRAME[0]), this.fromX(Plot.WIDTH - Plot.FRAME[2])];
      if (this.series) turn(this.key, Number(clamp(this.at(event), least, most).toPrecision(4)), true);
    });
  }
  at(event) {
    const box = this.cursor.getBoundingClientRect();
    return this.fromX(((event.clientX - box.left) / box.width) * Plot.WIDTH);
  }
  look(event) {
    if (this.series) this.tip.textContent = `${digits(this.at(event), 4)} ${rows.get(this.key)?.number.unit ?? ""}`;
  }
  // Coarse at once, then finer and with both models.
  async draw() {
    const row = rows.get(touched) ?? rows.get("slope_deg");
    if (!row || row.number.words) return;
    const { key, from, to, unit } = row.number;
    const { [key]: here, ...others } = state.set;
    const asked = JSON.stringify([state.config, others, key, models()]);
    byId("over").textContent = `Along ${key}`;
    if (asked === this.asked) return this.mark();
    [this.asked, this.key] = [asked, key];
    byId("along-said").textContent = "Computing …";
    const both = byId("contact").checked && rows.has("contact.stiffness");
    for (const [points, model] of [[12, "rigid"], [60, "rigid"], ...(both ? [[24, "both"]] : [])]) {
      const span = { over: key, from: Math.max(from, 1e-9), to, points, model, periods: 1 };
      const block = Object.fromEntries(Object.entries(span).map(([name, value]) => [`continuation.${name}`, value]));
      const set = { ...state.set, ...block };
      const [status, answer] = await ask("/api/along", question({ set })).catch(() => [0]);
      if (this.asked !== asked) return;
      if (status === 409) return (this.asked = null);
      if (status !== 200 || !answer.curves.length) {
        byId("along-said").textContent = status === 422 ? sentence(answer.error) : "No gaits are followed along this number.";
        if (status !== 200) return;
      } else byId("along-said").textContent = "Stable gaits are full lines; a click goes there.";
      [this.found, this.unit] = [answer.curves, unit];
      this.plot();
    }
  }
  plot() {
    if (!this.found?.length) return;
    const what = byId("what");
    this.titles = [this.unit && this.unit !== "1" ? `${this.key} (${this.unit})` : this.key, what.selectedOptions[0].text];
    const series = this.found.flatMap((curve) => {
      const pieces = [];
      curve.value.forEach((x, index) => {
        const y = curve[what.value][index];
        const last = pieces.at(-1);
        if (last && last.stable === curve.stable[index]) last.x.push(x), last.y.push(y);
        else {
          if (last) last.x.push(x), last.y.push(y);
          pieces.push({ x: [x], y: [y], stable: curve.stable[index], style: curve.model, dash: curve.stable[index] ? "" : "dashed" });
        }
      });
      return pieces;
    });
    super.draw(series, `${what.selectedOptions[0].text} of gaits over ${this.key}`);
    this.dot = element("circle", { r: 4.5 });
    this.cursor.replaceChildren(this.line, this.dot);
    this.mark();
  }
  mark() {
    if (!this.series || !shown) return;
    const value = state.set[this.key] ?? rows.get(this.key)?.number.value;
    const gait = shown.answer.fixedpoint;
    const height = byId("what").value === "speed_m_s" ? gait.step_length_m / gait.period_s : gait[byId("what").value];
    const [x, y] = [this.toX(value), this.toY(height)];
    for (const name of ["x1", "x2"]) this.line.setAttribute(name, Number.isFinite(x) ? x : -9);
    this.dot.setAttribute("cx", Number.isFinite(x) ? x : -9);
    this.dot.setAttribute("cy", Number.isFinite(y) ? clamp(y, 0, Plot.HEIGHT) : -9);
  }
}

// Out of the page

function leave(name, address) {
  Object.assign(document.createElement("a"), { download: name, href: address }).click();
}

function tell(text, url) {
  byId("made").textContent = `${text} `;
  if (url) byId("made").append(Object.assign(document.createElement("a"), { href: url, textContent: "Open it", target: "_blank" }));
}

async function save() {
  const [status, answer] = await ask("/api/save", question({ name: byId("name").value })).catch(() => [0]);
  tell(status === 200 ? `Saved: ${answer.file}` : status ? sentence(answer.error) : "The server does not answer.");
}

async function make(kind) {
  let [status, answer] = await ask("/api/job", question({ kind, models: models() })).catch(() => [0]);
  while (status === 200 && answer.running) {
    tell(`${kind}: ${answer.said || "begins"}`);
    await new Promise((resolve) => setTimeout(resolve, 500));
    [status, answer] = await ask("/api/job").catch(() => [0]);
  }
  if (status !== 200) return tell(status ? sentence(answer.error) : "The server does not answer.");
  tell(answer.error ? sentence(answer.error) : `The ${kind} is there.`, answer.url);
}

// The whole page

async function begin() {
  fromFragment();
  remember.last = fragment();
  let [status, answer] = await ask("/api/numbers", question()).catch(() => [0]);
  if (status === 422) [status, answer] = await ask("/api/numbers", { config: state.config });
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
byId("what").addEventListener("change", () => along.plot());
for (const model of Object.keys(MODELS)) {
  byId(model).addEventListener("change", () => {
    if (byId(model).checked) walk();
    else if (shown) draw();
    along.draw();
  });
}
byId("copy").addEventListener("click", () => navigator.clipboard.writeText(byId("command").textContent).then(() => tell("Copied.")));
byId("save").addEventListener("click", save);
byId("png").addEventListener("click", () => player && leave("walk.png", player.walk.canvas.toDataURL("image/png")));
for (const kind of ["gif", "report"]) byId(kind).addEventListener("click", () => make(kind));
addEventListener("popstate", begin);
begin();
