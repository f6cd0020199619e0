"use strict";
const byId = id => document.getElementById(id);
const COLORS = { "naive differentiation": "#8a929c", "edge sampling": "#0072b2", "warped area": "#d55e00",
  "warped area, mean over jumps": "#009e73", "direct: what is seen": "#cc79a7", "mean over jumps": "#009e73" };
const WINDOW = { left: 0, right: 10, bottom: -0.4, top: 6.8 };
const HANDLES = [["occluder", "ox", "oy"], ["light", "lx", "ly"], ["camera", "cx", "cy"], ["view"], ["turn"]];
let state = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
// What each teaches: a name, a state, and a sentence.
const PRESETS = [
  ["clutter", "leaves=40&samples=128&rays=16&moves=1", "A plant rises. Edge sampling draws points on all edges, of which most are hidden, and needs many times the rays of the mean over jumps, which averages the velocities of the edges near each sample. Naive differentiation sees nothing at all."],
  ["a shadow", "samples=256&rays=16&moves=3", "The light moves to the right. Nothing moves on the film but the shadow, a silhouette as the floor sees it; naive differentiation says that nothing changes."],
  ["one silhouette", "samples=256&rays=16&moves=1&ox=4.2&oy=3.2&ly=6.4&lx=7.6", "The occluder rises. Its silhouettes move over the film: peaks that naive differentiation does not see at all."],
  ["a lobe", "samples=256&rays=16&width=0.12&moves=0", "The floor shines. Light comes from one direction, and few samples decide: all methods grow noisier."],
  ["few rays are biased", "samples=1024&rays=2&moves=0", "Two auxiliary rays a sample: V is a quotient of two sums, and its mean is not the quotient of the means. The slope falls short of 1 by more than its error."],
  ["γ too small", "samples=1024&rays=64&gamma=0.25&moves=0", "With γ = 0.25 the weight hardly knows the silhouette: V misses its speed, and no number of rays helps."],
];
let numbers = null, busy = false, waits = false, chosen = 0, held = null, frames = [];

// The world's coordinates on the canvas, and back.
const at = ([x, y], box) => [(x - WINDOW.left) / (WINDOW.right - WINDOW.left) * box.width,
  (WINDOW.top - y) / (WINDOW.top - WINDOW.bottom) * box.height];
const back = (x, y, box) => [WINDOW.left + x / box.width * (WINDOW.right - WINDOW.left),
  WINDOW.top - y / box.height * (WINDOW.top - WINDOW.bottom)];

function value(name) { return name in state ? Number(state[name]) : Number(new URLSearchParams(numbers.link).get(name)); }
const within = (name, v) => { const [low, high] = numbers.ranges[name]; return Math.min(Math.max(v, low), high); };
function position(handle) {
  const [name, x, y] = HANDLES[handle];
  if (x) return [value(x), value(y)];
  const [from, angle, far] = name == "view" ? [[value("cx"), value("cy")], value("ca"), 1.3] : [[value("ox"), value("oy")], value("oa"), 0.95];
  return [from[0] + far * Math.cos(angle), from[1] + far * Math.sin(angle)];
}
function move(handle, [x, y]) {
  const [name, a, b] = HANDLES[handle];
  if (a) { state[a] = within(a, x); state[b] = within(b, y); }
  else if (name == "view") state.ca = within("ca", Math.atan2(y - value("cy"), x - value("cx")));
  else state.oa = Math.atan2(y - value("oy"), x - value("ox"));
  ask();
}

async function ask() {
  if (busy) { waits = true; return; }
  busy = true;
  const query = new URLSearchParams(state).toString();
  try {
    const quick = held !== null, response = await fetch((quick ? "/quick?" : "/numbers?") + query);
    const text = await response.text();
    byId("error").textContent = response.ok ? "" : text;
    if (response.ok) {
      numbers = JSON.parse(text);
      // What was dragged while the program computed is newer.
      if (!waits) state = Object.fromEntries(new URLSearchParams(numbers.link));
      history.replaceState(null, "", "#" + query);
      byId("link").href = "#" + query;
      frames = frames.concat(performance.now()).slice(-12);
      draw();
      document.body.dataset.shown = quick ? "" : query;
    } else if (numbers && !waits) state = Object.fromEntries(new URLSearchParams(numbers.link));
  } catch (error) { byId("error").textContent = "The program does not answer: is it still running?"; }
  busy = false;
  const noise = byId("noise").checked && !byId("error").textContent;
  if (noise && !waits) state.seed = (value("seed") + 1) % 1e9;
  if (waits || noise) { waits = false; setTimeout(ask, 0); }
}

function surface(id) {
  const canvas = byId(id), box = { width: canvas.clientWidth, height: canvas.clientHeight }, dense = devicePixelRatio || 1;
  canvas.width = box.width * dense; canvas.height = box.height * dense;
  const pen = canvas.getContext("2d");
  pen.scale(dense, dense);
  const style = getComputedStyle(document.documentElement);
  return [pen, box, style.getPropertyValue("--text"), style.getPropertyValue("--muted"), style.getPropertyValue("--line")];
}

function draw() {
  drawWorld(); drawImage(); drawWeights();
  const exact = { name: "exact", values: numbers.exact };
  plot("derivative", [...numbers.methods, exact], true, "change of radiance a unit of θ");
  plot("field", numbers.fields, false, "pixels a unit of θ");
  byId("fields").innerHTML = numbers.fields.map(f => `<span style="color:${COLORS[f.name]}">■</span> ${f.name}`).join(" · ");
  const isWrong = m => Math.abs(m.slope - 1) > Math.max(0.1, 4 * m.slope_error);
  const needed = m => isWrong(m) ? "never right" : Math.round(Number(m.needed.toPrecision(2))).toLocaleString("en");
  const row = m => `<tr><td style="color:${COLORS[m.name]}">■</td><td>${m.name}</td><td>${m.slope.toFixed(3)} ± ${m.slope_error.toFixed(3)}</td>` +
    `<td>${(100 * m.noise).toFixed(1)} %</td><td>${m.rays.toFixed(1)}</td><td>${needed(m)}</td></tr>`;
  byId("methods").tBodies[0].innerHTML = "<tr class='exact'><td>■</td><td>exact</td><td>1</td><td></td><td></td><td></td></tr>" + numbers.methods.map(row).join("");
  const rate = frames.length > 1 ? 1000 * (frames.length - 1) / (frames.at(-1) - frames[0]) : 0;
  byId("speed").textContent = `${numbers.milliseconds.toFixed(0)} ms a state` + (rate > 2 ? `, ${rate.toFixed(0)} a second` : "");
  for (const input of byId("settings").elements) if (input.name) show(input);
}

function drawWorld() {
  const [pen, box, text, muted, line] = surface("world");
  const path = points => { pen.beginPath(); points.forEach((p, i) => pen[i ? "lineTo" : "moveTo"](...at(p, box))); };
  const eye = numbers.eye, end = k => [eye[0] + 14 * numbers.view[k][0], eye[1] + 14 * numbers.view[k][1]];
  path([eye, end(0), end(1)]); pen.fillStyle = line; pen.globalAlpha = 0.35; pen.fill(); pen.globalAlpha = 1;
  for (const shape of numbers.shapes) {
    path(shape.points);
    pen.lineWidth = shape.name == "light" ? 6 : 3;
    pen.strokeStyle = { light: "#e69f00", occluder: "#0072b2", leaf: "#0072b2" }[shape.name] || muted;
    if (shape.name == "leaf") pen.lineWidth = 1.5;
    if (shape.is_closed) { pen.closePath(); pen.fillStyle = "#0072b255"; pen.fill(); }
    pen.stroke();
    const middle = shape.points.reduce((a, p) => [a[0] + p[0] / shape.points.length, a[1] + p[1] / shape.points.length], [0, 0]);
    if (shape.name != "leaf" && Math.hypot(...shape.motion) > 1e-9) arrow(pen, at(middle, box), at([middle[0] + shape.motion[0], middle[1] + shape.motion[1]], box));
  }
  const most = Math.max(...numbers.rays.map(ray => ray.share));
  for (const ray of [...numbers.rays].sort((a, b) => a.share - b.share)) {
    const part = ray.share / most;
    path([eye, ray.end]);
    pen.strokeStyle = `rgba(213,94,0,${0.12 + 0.8 * part})`; pen.lineWidth = 0.5 + 3 * part; pen.stroke();
  }
  if (value("moves") == 4) arrow(pen, at(eye, box), at([eye[0], eye[1] + 1], box));
  HANDLES.forEach(([name], i) => {
    const [x, y] = at(position(i), box);
    pen.beginPath(); pen.arc(x, y, i == chosen ? 9 : 7, 0, 7);
    pen.fillStyle = i == chosen ? "#d55e00" : text; pen.globalAlpha = name == "view" || name == "turn" ? 0.5 : 0.85; pen.fill(); pen.globalAlpha = 1;
    pen.fillStyle = text; pen.font = "12px system-ui"; pen.fillText(name, x + 11, y - 8);
  });
}
function arrow(pen, [x, y], [u, v]) {
  const angle = Math.atan2(v - y, u - x);
  pen.strokeStyle = "#d55e00"; pen.lineWidth = 2; pen.beginPath(); pen.moveTo(x, y); pen.lineTo(u, v);
  for (const side of [2.6, -2.6]) { pen.moveTo(u, v); pen.lineTo(u + 9 * Math.cos(angle + side), v + 9 * Math.sin(angle + side)); }
  pen.stroke();
}

function drawImage() {
  const [pen, box] = surface("image"), most = Math.max(...numbers.image), n = numbers.image.length;
  numbers.image.forEach((v, i) => {
    const grey = Math.round(255 * Math.pow(Math.max(v, 0) / most, 1 / 2.2)), [left, right] = [i, i + 1].map(k => LEFT + k * (box.width - LEFT) / n);
    pen.fillStyle = `rgb(${grey},${grey},${grey})`;
    pen.fillRect(left, 0, right - left + 0.5, box.height);
  });
  const x = LEFT + value("at") * (box.width - LEFT) / n;
  pen.strokeStyle = "#d55e00"; pen.lineWidth = 2; pen.beginPath(); pen.moveTo(x, 0); pen.lineTo(x, box.height); pen.stroke();
}

// Room for the numbers of the axis on the left.
const LEFT = 46;
// A step of 1, 2 or 5 times a power of ten, so that a span has about so many.
const tick = (span, count) => {
  const rough = span / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
  return power * [1, 2, 5, 10].find(k => k * power >= rough);
};
function plot(id, curves, withErrors, unit) {
  const [pen, box, text, muted, line] = surface(id), bottom = 18, height = box.height - bottom;
  // Every curve fits, and the exact one with its neighbourhood.
  const ends = curves.flatMap(c => c.values.flatMap((v, i) => withErrors && c.errors ? [v - c.errors[i], v + c.errors[i]] : [v]));
  const [least, most] = [Math.min(0, ...ends), Math.max(0, ...ends)], span = Math.max(most - least, 1e-3), room = 0.06 * span;
  const low = Math.min(least, most - span) - room, high = most + room, y = v => height * (high - v) / (high - low);
  const across = box.width - LEFT, count = numbers.exact.length, place = u => LEFT + u / count * across;
  pen.font = "11px system-ui"; pen.lineWidth = 1; pen.textBaseline = "middle";
  const step = tick(high - low, 4);
  for (let k = Math.ceil(low / step); k * step <= high; k++) {
    pen.strokeStyle = line; pen.beginPath(); pen.moveTo(LEFT, y(k * step)); pen.lineTo(box.width, y(k * step)); pen.stroke();
    pen.fillStyle = muted; pen.textAlign = "right"; pen.fillText(Number((k * step).toPrecision(3)), LEFT - 5, y(k * step));
  }
  pen.textAlign = "center";
  for (let u = 0; u <= count; u += 8) pen.fillText(u, Math.min(Math.max(place(u), LEFT), box.width - 8), height + 10);
  pen.textAlign = "left"; pen.fillText(unit, LEFT + 5, 9);
  pen.fillText("pixel", place(1.5), height + 10);
  for (const curve of curves) {
    const n = curve.values.length, x = i => place((i + 0.5) * count / n), color = COLORS[curve.name] || text;
    if (withErrors && curve.errors) {
      pen.beginPath();
      curve.values.forEach((v, i) => pen.lineTo(x(i), y(v + curve.errors[i])));
      for (let i = n - 1; i >= 0; i--) pen.lineTo(x(i), y(curve.values[i] - curve.errors[i]));
      pen.fillStyle = color; pen.globalAlpha = 0.18; pen.fill(); pen.globalAlpha = 1;
    }
    pen.beginPath();
    curve.values.forEach((v, i) => pen[i ? "lineTo" : "moveTo"](x(i), y(v)));
    pen.strokeStyle = color; pen.lineWidth = curve.name == "exact" ? 1.2 : 1.8; pen.stroke();
  }
}

// The weight of every auxiliary ray by its distance from the place, in kernel widths, coloured by what it hits.
function drawWeights() {
  const [pen, box, text, muted, line] = surface("weights"), reach = 3, width = 1 / Math.sqrt(value("kappa")), bottom = box.height - 18;
  const most = Math.max(...numbers.rays.map(ray => ray.share)), x = k => box.width * (0.5 + 0.48 * k / reach);
  pen.font = "11px system-ui"; pen.textBaseline = "middle"; pen.textAlign = "center";
  pen.strokeStyle = line; pen.beginPath(); pen.moveTo(0, bottom); pen.lineTo(box.width, bottom); pen.stroke();
  pen.fillStyle = muted;
  for (let k = -reach; k <= reach; k++) pen.fillText(k, x(k), bottom + 10);
  for (const ray of numbers.rays) {
    const at = x((ray.at - value("at")) / width), high = bottom - (bottom - 16) * ray.share / most;
    pen.strokeStyle = pen.fillStyle = ray.shape < 0 ? muted : ["#7b8794", "#4b5563", "#e69f00", "#0072b2"][Math.min(ray.shape, 3)];
    pen.lineWidth = 2; pen.beginPath(); pen.moveTo(at, bottom); pen.lineTo(at, high); pen.stroke();
    pen.beginPath(); pen.arc(at, high, 3, 0, 7); pen.fill();
  }
  pen.fillStyle = text; pen.textAlign = "left"; pen.fillText("largest " + (100 * most).toFixed(0) + " % of the weight; blue rays hit the occluder", 6, 9);
}

// Samples moved by each field while θ swings.
const SHAPES = ["#c9ced6", "#9aa3af", "#e69f00", "#56b4e9"];
function drawMotion(time) {
  if (numbers && numbers.swing.length) {
    const [pen, box, text] = surface("motion"), swing = numbers.swing, half = (swing.length - 1) / 2;
    const phase = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : Math.sin(time / 900);
    const moment = swing[Math.round(half + half * phase)], first = swing[half], n = first.seen.length, pixels = numbers.exact.length;
    const rows = [{ name: "no warp", values: first.seen.map(() => 0) }, ...numbers.fields], high = box.height / rows.length;
    const place = i => LEFT + i * (box.width - LEFT) / n;
    rows.forEach((field, row) => {
      const top = row * high;
      moment.seen.forEach((shape, i) => {
        pen.fillStyle = shape < 0 ? "#eceff3" : SHAPES[Math.min(shape, 3)];
        pen.globalAlpha = 0.55; pen.fillRect(place(i), top + 2, place(i + 1) - place(i) + 0.5, high - 6); pen.globalAlpha = 1;
      });
      let crossed = 0;
      for (let i = 1; i < n; i += 3) {
        const at = i + moment.theta * field.values[i] * n / pixels, now = moment.seen[Math.min(Math.max(Math.round(at), 0), n - 1)];
        // Leaves and the occluder are one thing here.
        const kind = shape => Math.min(shape, 3), changed = kind(now) != kind(first.seen[i]);
        crossed += changed;
        pen.fillStyle = changed ? "#d55e00" : "#1c2026";
        pen.beginPath(); pen.arc(place(at + 0.5), top + high / 2 + 1, changed ? 3.5 : 2, 0, 7); pen.fill();
      }
      pen.fillStyle = text; pen.font = "11px system-ui"; pen.textBaseline = "middle"; pen.textAlign = "left";
      pen.fillText(String(crossed), 4, top + high / 2); pen.fillText(field.name, LEFT + 4, top + 9);
    });
  }
  requestAnimationFrame(drawMotion);
}
requestAnimationFrame(drawMotion);

// Sliders may stand for powers, and for a word at their lower end.
function amount(input) {
  const power = Number(input.dataset.power || 0), zero = input.dataset.zero && Number(input.value) == Number(input.min);
  return zero ? 0 : power ? Math.pow(power, Number(input.value)) : Number(input.value);
}
function show(input) {
  const v = value(input.name), power = Number(input.dataset.power || 0);
  if (document.activeElement != input) input.value = power && v > 0 ? Math.log(v) / Math.log(power) : v;
  const output = input.parentElement.querySelector("output");
  if (output) output.textContent = v == 0 && input.dataset.zero ? input.dataset.zero : Number(v.toPrecision(3));
}
byId("settings").addEventListener("input", event => {
  if (event.target.name) { state[event.target.name] = amount(event.target); }
  ask();
});

const world = byId("world");
const place = event => { const box = world.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top, box]; };
world.addEventListener("pointerdown", event => {
  if (!numbers) return;
  const [x, y, box] = place(event);
  const far = HANDLES.map((_, i) => { const p = at(position(i), box); return Math.hypot(p[0] - x, p[1] - y); });
  const nearest = far.indexOf(Math.min(...far));
  if (far[nearest] > 40) return;
  held = chosen = nearest;
  try { world.setPointerCapture(event.pointerId); } catch (_) { /* the pointer is gone */ }
  move(held, back(x, y, box));
});
world.addEventListener("pointermove", event => { if (held !== null) { const [x, y, box] = place(event); move(held, back(x, y, box)); } });
for (const end of ["pointerup", "pointercancel"]) world.addEventListener(end, () => { if (held !== null) { held = null; ask(); } });
world.addEventListener("keydown", event => {
  if (!numbers) return;
  const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
  if (event.key == "Tab" && chosen + 1 < HANDLES.length && !event.shiftKey) { chosen += 1; draw(); event.preventDefault(); }
  if (step) { const p = position(chosen); move(chosen, [p[0] + step[0], p[1] + step[1]]); event.preventDefault(); }
});
byId("image").addEventListener("pointerdown", event => {
  if (!numbers) return;
  const box = byId("image").getBoundingClientRect();
  state.at = within("at", (event.clientX - box.left - LEFT) / (box.width - LEFT) * numbers.exact.length);
  ask();
});
for (const [name, link, lesson] of PRESETS) {
  const button = document.createElement("button");
  button.type = "button"; button.textContent = name;
  button.addEventListener("click", () => { begin(link); });
  button.dataset.link = link; button.dataset.lesson = lesson;
  byId("presets").append(button);
}
function begin(link) {
  state = Object.fromEntries(new URLSearchParams(link)); numbers = null; frames = [];
  for (const button of byId("presets").children) {
    button.setAttribute("aria-pressed", button.dataset.link == link);
    if (button.dataset.link == link) byId("lesson").textContent = button.dataset.lesson;
  }
  ask();
}
addEventListener("hashchange", () => { state = Object.fromEntries(new URLSearchParams(location.hash.slice(1))); ask(); });
addEventListener("resize", () => { if (numbers) draw(); });
byId("reset").addEventListener("click", event => { event.preventDefault(); begin(PRESETS[0][1]); });
if (location.hash.length > 1) ask(); else begin(PRESETS[0][1]);
