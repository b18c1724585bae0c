// The page: takes the server's messages apart and draws them.

import { drawBox } from "./box.js";
import { Chart, Series } from "./charts.js";
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { byId, figures, fixed, number, options, say } from "./dom.js";
import { showFolder, showLink, showNotes } from "./lists.js";
import { Rail } from "./rail.js";

const DEGREES = 180 / Math.PI;
const series = { carriage: new Series(), imu: new Series(), raw: new Series(), gcomp: new Series() };
const rail = new Rail(byId("rail"));
const charts = [
  new Chart(byId("position-chart"), [["reference", series.carriage, 2, 1], ["position", series.carriage, 1, 1]], 0.02),
  new Chart(byId("rate-chart"), ["x", "y", "z"].map((axis, i) => [axis, series.imu, 1 + i, DEGREES]), 1),
  new Chart(byId("force-chart"), ["x", "y", "z"].map((axis, i) => [axis, series.imu, 4 + i, 1]), 1),
  new Chart(byId("tilt-chart"), [["raw", series.raw, 1, 1], ["gcomp", series.gcomp, 1, 1]], 0.2),
];
const MODES = { UNHOMED: "not homed" }; // where the name alone is no word
let dirty = false;

const connection = new Connection(heard, changed);
const controls = new Controls(connection);

for (const id of ["sensor", "filter"]) {
  byId(id).addEventListener("change", () => {
    Object.values(series).forEach((one) => one !== series.carriage && one.take({ afresh: true, rows: [] }));
    connection.send({ type: "view", sensor: byId("sensor").value, filter: id === "sensor" ? "" : byId("filter").value });
    document.activeElement.blur();
  });
}

function changed(connected) {
  say(byId("connection"), connected ? "live" : "not connected");
  byId("connection").className = `pill ${connected ? "good" : "bad"}`;
  document.body.classList.toggle("lost", !connected);
  if (!connected) {
    controls.lost();
    say(byId("mode"), "not connected");
    byId("light").dataset.light = "OFF";
  }
}

function heard(message) {
  if (message.type === "state") show(message);
  else if (message.type === "answer") controls.answer(message);
  else if (message.type === "folder") showFolder(message);
}

function show(state) {
  const { rig, link } = state;
  byId("banner").hidden = state.may_command;
  say(byId("banner"), "Looking on: to move the rig, open the address that the dashboard printed. Stop works from here too.");
  say(byId("unit"), link?.unit_id ? `unit ${link.unit_id}` : "");
  showRig(rig);
  series.carriage.take(state.carriage);
  showImu(state);
  showAttitude(state);
  showLink(link, state.battery);
  showNotes(state.notes);
  controls.show(state);
  if (!dirty) {
    dirty = true;
    requestAnimationFrame(draw);
  }
}

function draw() {
  dirty = false;
  for (const chart of charts) chart.draw();
}

function showRig(rig) {
  const alive = rig !== null && !rig.silent;
  say(byId("mode"), alive ? MODES[rig.mode] ?? rig.mode.toLowerCase() : rig === null ? "no rig" : "rig silent");
  byId("light").dataset.light = alive ? rig.light : "OFF";
  byId("light").title = `traffic light: ${alive ? rig.light.toLowerCase() : "unknown"}`;
  say(byId("fault"), alive && rig.fault !== "NONE" ? `${rig.fault}: ${rig.fault_text}` : "");
  say(byId("carriage-note"), alive && rig.mode === "UNHOMED" ? "press Home: till then the position counts from where it was switched on" : "");
  byId("carriage-card").classList.toggle("stale", !alive);
  if (rig === null) return;
  rail.show(rig);
  figures(byId("carriage"), [
    ["position", number(rig.position === null ? null : rig.position * 1000, 1, "mm")],
    ["velocity", number(rig.velocity, 3, "m/s")],
    ["tracking error", number(rig.tracking_error === null ? null : rig.tracking_error * 1000, 2, "mm")],
    ["current", number(rig.current, 2, "A")],
    ["duty", number(rig.duty === null ? null : 100 * rig.duty, 0, "%")],
    ["switches", ["left", "centre", "right", "optical"].filter((_name, i) => rig.switches[i]).join(", ") || "none"],
  ]);
}

function showImu({ imu, sensors, sensor }) {
  options(byId("sensor"), sensors, sensor);
  byId("imu-card").classList.toggle("stale", imu === null || imu.silent);
  if (imu === null) {
    say(byId("imu-note"), "nothing on imu/data_raw");
    return;
  }
  series.imu.take(imu);
  const newest = series.imu.rows.get(series.imu.newest);
  const rate = newest ? newest.slice(1, 4).map((value) => fixed(value * DEGREES, 2)).join(", ") : "";
  const warmth = imu.temperature === null ? "" : `; ${fixed(imu.temperature, 1)} °C`;
  say(byId("imu-note"), imu.silent ? "silent" : `x, y, z now ${rate} deg/s${warmth}`);
  byId("force-chart").parentElement.hidden = !imu.has_force;
}

function showAttitude({ attitude, filters, filter, sensor }) {
  options(byId("filter"), filters, filter);
  for (const name of ["raw", "gcomp"]) {
    const seen = attitude[name];
    if (seen !== null) series[name].take(seen.tilt);
    drawBox(byId(`box-${name}`), seen?.q ?? null);
    byId(`box-${name}`).parentElement.classList.toggle("stale", seen === null || seen.silent);
    const absent = name === "gcomp" ? "needs a compensation file" : "no filter publishes";
    say(byId(`angles-${name}`), seen === null ? absent
      : ["roll", "pitch", "heading"].map((angle, i) => `${angle} ${fixed(seen.angles[i], 2)}°`).join("  "));
  }
  say(byId("apart"), attitude.apart === null ? (filter ? "" : `no orientation of ${sensor || "a sensor"}`) : `${attitude.apart.toFixed(3)}° apart`);
}
