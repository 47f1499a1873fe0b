// Points of interest on the map: what the robot's registry holds, and edits of it, each "saved" only when the registry said so.

import { MapView } from "./view.js";

const POLL_MS = 500;
const ANSWER_WITHIN_MS = 20000;
const MOST_ROWS = 300;
const MOST_UNDONE = 50;
const FIELDS = ["poi_id", "name", "x", "y", "z", "extent_m", "tags"];
const NUMBERS = ["x", "y", "z", "extent_m"];
const OF_SERVER = { "position_m": "x", "position_m.0": "x", "position_m.1": "y", "position_m.2": "z" };

const token = new URLSearchParams(location.hash.slice(1)).get("token") || "";
const el = (id) => document.getElementById(id);
const form = el("form");
const view = new MapView(el("canvas"));

let site = null;
let pois = new Map(); // by id, as the registry has them
let version = "";
let live = { robot_pose: null, persons: [] };
let trouble = "connecting";
let passing = null; // what is said for a moment: { text, bad, until }
let draft = null; // what the form holds: { adds, base, values, error, field, note, saving, from }
let undoable = []; // newest last: { what, poi_id, before, after }
let fitted = false;

// --- the server

async function ask(method, path, content) {
  const options = { method, headers: { "X-Deixis-Token": token }, signal: AbortSignal.timeout(ANSWER_WITHIN_MS), cache: "no-store" };
  if (content !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(content);
  }
  let reply;
  try {
    reply = await fetch(path, options);
  } catch {
    throw new Refusal("'deixis poi edit' does not answer: has it ended? Start it again", "");
  }
  if (!reply.ok) {
    const said = await reply.json().catch(() => ({ error: `${reply.status} ${reply.statusText}` }));
    throw new Refusal(said.error, said.field || "");
  }
  return reply;
}

class Refusal extends Error {
  constructor(text, field) {
    super(text);
    this.field = field;
  }
}

const put = async (poi, adds) => (await (await ask("PUT", address(poi.poi_id) + (adds ? "?new=1" : ""), content(poi))).json()).poi;
const remove = async (id) => (await (await ask("DELETE", address(id))).json()).poi;
const address = (id) => `api/pois/${encodeURIComponent(id)}`;
const content = ({ poi_id, name, position_m, extent_m, tags }) => ({ poi_id, name, position_m, extent_m, tags });

async function begin() {
  try {
    site = await (await ask("GET", "api/site")).json();
    if (site.picture) view.picture = await createImageBitmap(await (await ask("GET", "api/map.png")).blob());
  } catch (error) {
    trouble = error.message;
    showAll();
    setTimeout(begin, 2000);
    return;
  }
  el("robot").textContent = site.robot;
  el("site").textContent = site.name;
  document.title = `Points of interest of ${site.robot}`;
  fit();
  fitted = false; // once more when the points are known
  restoreDraft();
  await poll();
}

async function poll() {
  const before = JSON.stringify([live, trouble]);
  try {
    const said = await (await ask("GET", `api/live?version=${version}`)).json();
    live = said;
    trouble = said.trouble;
    if (said.pois) takePois(said.pois, said.version);
    delete said.pois;
    if (!fitted && !trouble) fit();
  } catch (error) {
    trouble = error.message;
  }
  // Twice a second the same picture would empty a tablet's battery.
  if (passing || JSON.stringify([live, trouble]) !== before) showAll();
  setTimeout(poll, document.hidden ? 4 * POLL_MS : POLL_MS);
}

function takePois(list, of) {
  version = of;
  pois = new Map(list.map((poi) => [poi.poi_id, poi]));
  // Somebody else's edit of what stands in the form: taken over, unless there is something to lose.
  if (draft && !draft.adds && !draft.saving && theirs() !== draft.base && !changed()) {
    if (theirs()) open(theirs());
    else close();
  }
}

// What the registry has in place of what the form began with; that itself where it is the same.
function theirs() {
  const now = pois.get(draft.base.poi_id) || null;
  return now && JSON.stringify(now) === JSON.stringify(draft.base) ? draft.base : now;
}

// --- the form

function valuesOf(poi) {
  const [x, y, z] = poi.position_m;
  return { poi_id: poi.poi_id, name: poi.name, x: plain(x), y: plain(y), z: plain(z), extent_m: plain(poi.extent_m), tags: poi.tags.join(", ") };
}

const plain = (number) => String(Math.round(number * 1000) / 1000);
const labelOf = (field) => form.elements[field].labels[0].firstChild.textContent.trim();

// With a point or a comma before the decimals; null for all that is no such number.
function number(text) {
  const decimal = text.trim().replace(",", ".");
  return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(decimal) ? Number(decimal) : null;
}

// The first field with something else than a number in it, where one is needed.
function noNumber({ values, base }) {
  const stored = base ? valuesOf(base) : {};
  return NUMBERS.find((field) => values[field] !== stored[field] && number(values[field]) === null);
}

function refusalOf(error) {
  const field = OF_SERVER[error.field] || error.field.split(".")[0];
  const label = FIELDS.includes(field) ? labelOf(field) : "";
  const named = error.field && error.message.startsWith(`${error.field}: `) ? error.message.slice(error.field.length + 2) : error.message;
  return { field, error: `not saved: ${label ? `${label} (${error.field}): ${named}` : error.message}` };
}

// Numbers that were not touched stay as exact as they are stored.
function poiOf({ values, base }) {
  const stored = base ? valuesOf(base) : {};
  const kept = (field, value) => (base && values[field] === stored[field] ? value : number(values[field]));
  const position_m = ["x", "y", "z"].map((field, axis) => kept(field, base?.position_m[axis]));
  const tags = base && values.tags === stored.tags ? base.tags : values.tags.split(",").map((tag) => tag.trim()).filter(Boolean);
  return { poi_id: values.poi_id.trim(), name: values.name.trim(), position_m, extent_m: kept("extent_m", base?.extent_m), tags };
}

const changed = () => draft && (draft.adds || FIELDS.some((field) => draft.values[field] !== valuesOf(draft.base)[field]));

function open(poi) {
  draft = { adds: false, base: poi, values: valuesOf(poi), error: "", field: "", note: "", saving: false };
  fillForm();
}

function openNew([x, y]) {
  const last = undoable.findLast((edit) => edit.after)?.after;
  const [height, extent] = last ? [last.position_m[2], last.extent_m] : [1, 0.5];
  const values = { poi_id: freeId(), name: "", x: x.toFixed(2), y: y.toFixed(2), z: plain(height), extent_m: plain(extent), tags: "" };
  draft = { adds: true, base: null, values, error: "", field: "", note: "", saving: false };
  fillForm();
  if (matchMedia("(pointer: fine)").matches) form.elements.name.focus();
}

// The next of those that are numbered, as P11 behind P10.
function freeId() {
  const numbered = [...pois.keys()].map((id) => /^(.*?)(\d{1,6})$/.exec(id)).filter(Boolean);
  const prefix = numbered.length ? numbered[numbered.length - 1][1] : "P";
  const most = numbered.filter((found) => found[1] === prefix).reduce((a, found) => Math.max(a, Number(found[2])), 0);
  return `${prefix}${most + 1}`;
}

function close() {
  draft = null;
  showAll();
}

function fillForm() {
  for (const field of FIELDS) form.elements[field].value = draft.values[field];
  showAll();
}

async function save() {
  const mine = draft;
  if (!mine || mine.saving || !changed()) return;
  const wrong = noNumber(mine);
  if (wrong) {
    Object.assign(mine, { note: "", field: wrong, error: `not saved: ${labelOf(wrong)}: "${mine.values[wrong].trim()}" is no number, such as 1.25` });
    showAll();
    return;
  }
  const poi = poiOf(mine), sent = JSON.stringify(mine.values);
  Object.assign(mine, { saving: true, error: "", field: "", note: "saving" });
  showAll();
  try {
    const stored = await put(poi, mine.adds);
    took(stored, mine.adds ? "adding" : "changing", mine.base);
    // What was typed on meanwhile is still to be saved.
    const more = JSON.stringify(mine.values) !== sent;
    Object.assign(mine, { adds: false, base: stored, from: null, note: `saved ${clock(new Date())}` });
    if (!more) mine.values = valuesOf(stored);
    mine.saving = false;
    if (draft === mine) more ? showAll() : fillForm();
  } catch (error) {
    Object.assign(mine, { saving: false, note: "", ...refusalOf(error) });
    if (draft !== mine) draft = mine; // what was typed is never lost in silence
    fillForm();
  }
}

// The registry said yes.
function took(stored, what, before) {
  pois.set(stored.poi_id, stored);
  undoable = [...undoable, { what, poi_id: stored.poi_id, before, after: stored }].slice(-MOST_UNDONE);
}

async function removeChosen() {
  const poi = draft?.base;
  if (!poi || draft.saving) return;
  if (!(await confirmed(`Delete "${poi.name || poi.poi_id}" (${poi.poi_id})? People can no longer point at it.`, "Delete"))) return;
  const mine = draft;
  Object.assign(mine, { saving: true, error: "", note: "deleting" });
  showAll();
  try {
    const gone = await remove(poi.poi_id);
    pois.delete(poi.poi_id);
    undoable = [...undoable, { what: "deleting", poi_id: poi.poi_id, before: gone, after: null }].slice(-MOST_UNDONE);
    if (draft === mine) draft = null;
    say(`deleted ${poi.poi_id}`);
  } catch (error) {
    Object.assign(mine, { saving: false, note: "", error: `not deleted: ${error.message}` });
  }
  showAll();
}

async function undo() {
  const edit = undoable.at(-1);
  if (!edit || (changed() && !(await discards()))) return;
  const now = pois.get(edit.poi_id);
  if ((now?.edited_ns || 0) !== (edit.after?.edited_ns || 0)) {
    const who = now?.edited_by || "somebody";
    if (!(await confirmed(`"${edit.poi_id}" was edited by ${who} since. Undo your edit all the same?`, "Undo"))) return;
  }
  el("undo").disabled = true;
  try {
    if (edit.before) pois.set(edit.poi_id, await put(edit.before, false));
    else {
      await remove(edit.poi_id);
      pois.delete(edit.poi_id);
    }
    undoable = undoable.filter((other) => other !== edit);
    // Of an edit before that one, this is what it came to.
    const earlier = undoable.findLast((other) => other.poi_id === edit.poi_id);
    if (earlier) earlier.after = pois.get(edit.poi_id) || null;
    if (edit.before) open(pois.get(edit.poi_id));
    else draft = null;
    say(`undone: ${edit.what} ${edit.poi_id}`);
  } catch (error) {
    say(`not undone: ${error.message}`, true);
  }
  showAll();
}

// --- input that is not saved outlives a reload

function keepDraft() {
  const name = `deixis draft ${site?.robot}`;
  if (!site) return;
  if (changed()) sessionStorage.setItem(name, JSON.stringify({ adds: draft.adds, base: draft.base, values: draft.values }));
  else sessionStorage.removeItem(name);
}

function restoreDraft() {
  const kept = sessionStorage.getItem(`deixis draft ${site.robot}`);
  if (!kept) return;
  draft = { ...JSON.parse(kept), error: "", field: "", note: "not saved yet", saving: false };
  fillForm();
}

window.addEventListener("beforeunload", (event) => changed() && event.preventDefault());

// --- questions

function confirmed(text, yes) {
  const dialog = el("question");
  dialog.querySelector("p").textContent = text;
  dialog.querySelector("[value=yes]").textContent = yes;
  dialog.returnValue = "no";
  dialog.showModal();
  return new Promise((resolve) => dialog.addEventListener("close", () => resolve(dialog.returnValue === "yes"), { once: true }));
}

const discards = () => confirmed(`What you typed for "${draft.values.poi_id || "the new point"}" is not saved.`, "Discard it");

// --- showing

function say(text, bad = false) {
  passing = { text, bad, until: Date.now() + 6000 };
}

function showAll() {
  keepDraft();
  showStatus();
  showForm();
  showList();
  drawSoon();
}

function showStatus() {
  if (Date.now() > passing?.until) passing = null;
  const status = el("status");
  const level = trouble || passing?.bad ? "trouble" : "ok";
  const text = trouble ? sentence(trouble) : passing ? passing.text : "live";
  if (status.textContent !== text) status.textContent = text;
  status.dataset.level = level;
  el("undo").disabled = !undoable.length;
  el("undo").title = undoable.length ? `undo ${undoable.at(-1).what} ${undoable.at(-1).poi_id}` : "";
}

function sentence(said) {
  return `${said[0].toUpperCase()}${said.slice(1)}.${changed() ? " What you typed stays here." : ""}`;
}

function showForm() {
  form.hidden = !draft;
  el("hint").hidden = Boolean(draft) || pois.size > 3;
  if (!draft) return;
  el("form-title").textContent = draft.adds ? "New point" : draft.base.name || draft.base.poi_id;
  form.elements.poi_id.readOnly = !draft.adds;
  for (const field of FIELDS) form.elements[field].setAttribute("aria-invalid", String(draft.field === field));
  const message = el("message");
  message.textContent = draft.error || (changed() && !draft.saving ? (draft.adds ? "not saved yet" : "changed, not saved yet") : draft.note);
  message.dataset.level = draft.error ? "bad" : draft.note.startsWith("saved") && !changed() ? "good" : "waiting";
  el("save").disabled = draft.saving || !changed();
  el("save").textContent = draft.adds ? "Add" : "Save";
  el("cancel").textContent = changed() ? "Cancel" : "Close";
  el("delete").hidden = draft.adds;
  el("delete").disabled = draft.saving;
  el("edited").textContent = draft.base ? edited(draft.base) : "";
  showNotice();
}

function showNotice() {
  const now = draft.adds || draft.saving ? draft.base : theirs();
  const differs = now !== draft.base;
  el("notice").hidden = !differs;
  if (!differs) return;
  el("notice").firstElementChild.textContent = now
    ? `Changed by ${now.edited_by || "somebody"} meanwhile; saving replaces that.`
    : "Deleted by somebody meanwhile; saving adds it again.";
}

function edited(poi) {
  if (!poi.edited_ns) return "";
  const when = new Date(poi.edited_ns / 1e6);
  return `Last edited ${when.toLocaleDateString()} ${clock(when)}${poi.edited_by ? ` by ${poi.edited_by}` : ""}`;
}

const clock = (when) => when.toLocaleTimeString();
let listed = "";

function showList() {
  const wanted = el("search").value.trim().toLowerCase();
  const key = `${version} ${pois.size} ${wanted} ${draft?.base?.poi_id} ${draft?.base?.edited_ns}`;
  if (key === listed) return;
  listed = key;
  const matches = (poi) => [poi.poi_id, poi.name, ...poi.tags].some((text) => text.toLowerCase().includes(wanted));
  const found = [...pois.values()].filter(matches).sort((a, b) => a.poi_id.localeCompare(b.poi_id, undefined, { numeric: true }));
  el("pois").replaceChildren(...found.slice(0, MOST_ROWS).map(row));
  el("count").textContent = `${pois.size} point${pois.size === 1 ? "" : "s"}`;
  el("more").hidden = found.length <= MOST_ROWS && found.length > 0;
  el("more").textContent = found.length ? `and ${found.length - MOST_ROWS} more: search` : wanted ? "none of that name" : "none yet: click the map";
}

function row(poi) {
  const button = document.createElement("button"), name = document.createElement("b"), place = document.createElement("span");
  button.type = "button";
  button.title = poi.poi_id;
  button.setAttribute("aria-current", String(draft?.base?.poi_id === poi.poi_id));
  name.textContent = poi.name ? `${poi.name}` : poi.poi_id;
  place.textContent = `${poi.name ? `${poi.poi_id} · ` : ""}${poi.position_m[0].toFixed(1)}, ${poi.position_m[1].toFixed(1)}`;
  button.append(name, place);
  button.addEventListener("click", async () => {
    if (changed() && !(await discards())) return;
    open(pois.get(poi.poi_id) || poi);
    if (!view.shows(poi.position_m)) view.centre = poi.position_m.slice(0, 2);
  });
  const item = document.createElement("li");
  item.append(button);
  return item;
}

let drawing = false;

function drawSoon() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    if (site) view.draw(scene());
  });
}

function scene() {
  const persons = live.persons.map((p) => ({ person_id: p.person_id, place: p.position_m, at: pois.get(p.points_at)?.position_m }));
  return { site, robot: live.robot_pose || site.robot_pose, name: site.robot, persons, marks: marks() };
}

function marks() {
  const all = [];
  for (const poi of pois.values()) if (!draft?.base || poi.poi_id !== draft.base.poi_id) all.push(markOf(poi));
  if (!draft) return all;
  const { values, base } = draft, place = ["x", "y"].map((field, axis) => number(values[field]) ?? base?.position_m[axis] ?? 0);
  const moved = base && Math.hypot(place[0] - base.position_m[0], place[1] - base.position_m[1]) > 0.002;
  const name = values.name.trim() || values.poi_id;
  all.push({ poi: base, place, extent: number(values.extent_m) ?? base?.extent_m ?? 0, name, chosen: true, unsaved: changed(), from: moved ? base.position_m : null });
  return all;
}

const markOf = (poi) => ({ poi, place: poi.position_m, extent: poi.extent_m, name: poi.name || poi.poi_id });

function fit() {
  const around = [...pois.values()].map((poi) => poi.position_m).concat(site.walls.flat(), [live.robot_pose || site.robot_pose]);
  if (site.picture) {
    const [x, y, yaw] = site.picture.origin, [across, up] = site.picture.size_m, cos = Math.cos(yaw), sin = Math.sin(yaw);
    for (const [a, b] of [[0, 0], [across, 0], [0, up], [across, up]]) around.push([x + a * cos - b * sin, y + a * sin + b * cos]);
  }
  view.fit(around);
  fitted = true;
  drawSoon();
}

// --- hands on the map: click, drag, pan, pinch

const touching = new Map(); // pointers that are down, by number: where
let held = null; // { mark, from, moved }: what the first of them began on

const at = (event) => [event.offsetX, event.offsetY];
const slack = (event) => (event.pointerType === "mouse" ? 4 : 10);

view.canvas.addEventListener("pointerdown", (event) => {
  if (event.button !== 0 && event.pointerType === "mouse") return;
  view.canvas.setPointerCapture(event.pointerId);
  touching.set(event.pointerId, at(event));
  const mark = view.nearest(marks(), at(event), event.pointerType === "mouse" ? 12 : 24);
  held = touching.size === 1 ? { mark, from: at(event), moved: false } : null;
});

view.canvas.addEventListener("pointermove", (event) => {
  const now = at(event), before = touching.get(event.pointerId);
  showCursor(now);
  if (!before) {
    view.canvas.style.cursor = view.nearest(marks(), now, 12) ? "grab" : "crosshair";
    return;
  }
  if (touching.size === 2) pinch(event.pointerId, before, now);
  else if (held) drag(event, before, now);
  touching.set(event.pointerId, now);
  drawSoon();
});

function pinch(id, before, now) {
  const other = [...touching].find(([key]) => key !== id)[1];
  const apart = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
  view.panBy((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
  view.zoomAt([(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], apart(now) / apart(before));
}

function drag(event, before, now) {
  if (!held.moved && Math.hypot(now[0] - held.from[0], now[1] - held.from[1]) < slack(event)) return;
  if (!held.moved) {
    held.moved = true;
    // Another one than in a form with something unsaved in it is not dragged: that form would be lost.
    if (held.mark && !held.mark.chosen) changed() ? (held.mark = null) : open(held.mark.poi);
    held.clean = !changed();
  }
  if (!held.mark) {
    view.panBy(now[0] - before[0], now[1] - before[1]);
    return;
  }
  const [x, y] = view.toMetres(now);
  Object.assign(draft.values, { x: x.toFixed(2), y: y.toFixed(2) });
  fillForm();
}

view.canvas.addEventListener("pointerup", async (event) => {
  const done = touching.size === 1 ? held : null;
  touching.delete(event.pointerId);
  held = null;
  if (!done) return;
  if (!done.moved) await click(done.mark, done.from);
  else if (done.mark && done.clean) await save();
});

view.canvas.addEventListener("pointercancel", (event) => {
  touching.delete(event.pointerId);
  held = null;
});

async function click(mark, pixel) {
  if (mark?.chosen) return;
  if (!mark && draft?.adds && !draft.saving) {
    const [x, y] = view.toMetres(pixel);
    Object.assign(draft.values, { x: x.toFixed(2), y: y.toFixed(2) });
    fillForm();
    return;
  }
  const place = view.toMetres(pixel); // the map may be moved while the question stands
  if (changed() && !(await discards())) return;
  mark ? open(mark.poi) : openNew(place);
}

view.canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  view.zoomAt(at(event), Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
  drawSoon();
}, { passive: false });

view.canvas.addEventListener("pointerleave", () => (el("cursor").textContent = ""));

function showCursor(pixel) {
  const [x, y] = view.toMetres(pixel);
  el("cursor").textContent = `x ${x.toFixed(2)} m   y ${y.toFixed(2)} m`;
}

// --- the rest

form.addEventListener("input", (event) => {
  draft.values[event.target.name] = event.target.value;
  Object.assign(draft, { error: "", field: "" });
  showAll();
});
form.addEventListener("submit", (event) => {
  event.preventDefault();
  save();
});
el("cancel").addEventListener("click", close);
el("delete").addEventListener("click", removeChosen);
el("take-theirs").addEventListener("click", () => (theirs() ? open(theirs()) : close()));
el("undo").addEventListener("click", undo);
el("search").addEventListener("input", showList);
el("fit").addEventListener("click", fit);
for (const [id, factor] of [["zoom-in", 1.4], ["zoom-out", 1 / 1.4]]) {
  el(id).addEventListener("click", () => {
    view.zoomAt(view.size.map((side) => side / 2), factor);
    drawSoon();
  });
}

async function leaveForm() {
  if (draft.adds || !changed() || (await discards())) close();
}

document.addEventListener("keydown", (event) => {
  if (el("question").open) return;
  const typing = event.target.matches("input");
  if (event.key === "Escape" && draft && !draft.saving) leaveForm();
  else if (event.key === "z" && (event.ctrlKey || event.metaKey) && !typing) undo();
  else if (event.key === "Delete" && !typing && draft && !draft.adds) removeChosen();
  else return;
  event.preventDefault();
});

new ResizeObserver(drawSoon).observe(view.canvas);
window.addEventListener("hashchange", () => location.reload());

begin();
