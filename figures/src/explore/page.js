"use strict";
const byId = id => document.getElementById(id);
const COLORS = { "naive differentiation": "#8a929c", "edge sampling": "#0072b2", "warped area": "#d55e00",
  "warped area, mean over jumps": "#009e73", "direct: what is seen": "#cc79a7", "mean over jumps": "#009e73" };
const WINDOW = { left: 0, right: 10, bottom: -0.4, top: 6.8 };
const HANDLES = [["occluder", "ox", "oy"], ["light", "lx", "ly"], ["camera", "cx", "cy"], ["view"], ["turn"]];
let state = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
let numbers = null, busy = false, waits = false, chosen = 0, held = null, frames = [];

// The world's coordinates on the canvas, and back.
const at = ([x, y], box) => [(x - WINDOW.left) / (WINDOW.right - WINDOW.left) * box.width,
  (WINDOW.top - y) / (WINDOW.top - WINDOW.bottom) * box.height];
const back = (x, y, box) => [WINDOW.left + x / box.width * (WINDOW.right - WINDOW.left),
  WINDOW.top - y / box.height * (WINDOW.top - WINDOW.bottom)];

function value(name) { return name in state ? Number(state[name]) : Number(new URLSearchParams(numbers.link).get(name)); }
function position(handle) {
  const [name, x, y] = HANDLES[handle];
  if (x) return [value(x), value(y)];
  const [from, angle, far] = name == "view" ? [[value("cx"), value("cy")], value("ca"), 1.3] : [[value("ox"), value("oy")], value("oa"), 0.95];
  return [from[0] + far * Math.cos(angle), from[1] + far * Math.sin(angle)];
}
function move(handle, [x, y]) {
  const [name, a, b] = HANDLES[handle];
  if (a) { state[a] = x; state[b] = y; }
  else if (name == "view") state.ca = Math.atan2(y - value("cy"), x - value("cx"));
  else state.oa = Math.atan2(y - value("oy"), x - value("ox"));
  ask();
}

async function ask() {
  if (busy) { waits = true; return; }
  busy = true;
  const query = new URLSearchParams(state).toString();
  try {
    const response = await fetch("/numbers?" + query);
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
  drawWorld(); drawImage();
  const exact = { name: "exact", values: numbers.exact };
  plot("derivative", [...numbers.methods, exact], true);
  plot("field", numbers.fields, false);
  byId("fields").innerHTML = numbers.fields.map(f => `<span style="color:${COLORS[f.name]}">■</span> ${f.name}`).join(" · ");
  const row = m => `<tr><td style="color:${COLORS[m.name]}">■</td><td>${m.name}</td><td>${m.slope.toFixed(3)} ± ${m.slope_error.toFixed(3)}</td>` +
    `<td>${(100 * m.noise).toFixed(1)} %</td><td>${m.rays.toFixed(1)}</td></tr>`;
  byId("methods").tBodies[0].innerHTML = numbers.methods.map(row).join("");
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
    pen.strokeStyle = { light: "#e69f00", occluder: "#0072b2" }[shape.name] || muted;
    if (shape.is_closed) { pen.closePath(); pen.fillStyle = "#0072b255"; pen.fill(); }
    pen.stroke();
    const middle = shape.points.reduce((a, p) => [a[0] + p[0] / shape.points.length, a[1] + p[1] / shape.points.length], [0, 0]);
    if (Math.hypot(...shape.motion) > 1e-9) arrow(pen, at(middle, box), at([middle[0] + shape.motion[0], middle[1] + shape.motion[1]], box));
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
    const grey = Math.round(255 * Math.pow(Math.max(v, 0) / most, 1 / 2.2));
    pen.fillStyle = `rgb(${grey},${grey},${grey})`;
    pen.fillRect(i * box.width / n, 0, box.width / n + 1, box.height);
  });
}

function plot(id, curves, withErrors) {
  const [pen, box, text, , line] = surface(id);
  const exact = curves.find(c => c.name == "exact") || curves[0];
  const most = 1.3 * Math.max(1e-9, ...exact.values.map(Math.abs)), y = v => box.height * (0.5 - 0.5 * v / most);
  pen.strokeStyle = line; pen.beginPath(); pen.moveTo(0, y(0)); pen.lineTo(box.width, y(0)); pen.stroke();
  for (const curve of curves) {
    const n = curve.values.length, x = i => (i + 0.5) * box.width / n, color = COLORS[curve.name] || text;
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
for (const end of ["pointerup", "pointercancel"]) world.addEventListener(end, () => { held = null; });
world.addEventListener("keydown", event => {
  const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
  if (event.key == "Tab" && chosen + 1 < HANDLES.length && !event.shiftKey) { chosen += 1; draw(); event.preventDefault(); }
  if (step) { const p = position(chosen); move(chosen, [p[0] + step[0], p[1] + step[1]]); event.preventDefault(); }
});
addEventListener("hashchange", () => { state = Object.fromEntries(new URLSearchParams(location.hash.slice(1))); ask(); });
addEventListener("resize", () => { if (numbers) draw(); });
byId("reset").addEventListener("click", event => { event.preventDefault(); state = {}; numbers = null; ask(); });
ask();
