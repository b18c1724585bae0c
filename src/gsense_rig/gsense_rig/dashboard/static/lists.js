// What nodes say, campaigns, reports.

import { byId, figures, make, number, say } from "./dom.js";

export function showLink(link, battery) {
  const entries = link === null ? [["bridge", "silent", true]] : [
    ["frames", link.silent ? "silent" : number(link.rate_hz, 0, "Hz"), link.silent],
    ["lost", `${link.lost} of ${link.received + link.lost + link.corrupt} (${(100 * link.loss).toFixed(3)} %)`, link.lost_lately > 0],
    ["corrupt", String(link.corrupt)],
    ["board starts", String(link.restarts)],
    ["clock", number(link.clock_skew_ppm, 1, "ppm")],
    ["board up", number(link.uptime_s, 0, "s")],
  ];
  if (battery !== null) {
    const share = battery.percentage === null ? "" : `, ${(100 * battery.percentage).toFixed(0)} %`;
    entries.push(["battery", number(battery.voltage, 2, "V") + share, battery.percentage !== null && battery.percentage < 0.15]);
  }
  figures(byId("link"), entries);
  byId("link").classList.toggle("stale", Boolean(link?.silent));
}

/** Fill a list anew where its content has changed. */
function fill(list, items, build, empty) {
  const content = JSON.stringify(items);
  if (list.dataset.content === content) return;
  list.dataset.content = content;
  list.replaceChildren(...(items.length ? items.map(build) : [make("li", empty, { class: "quiet" })]));
}

export function showNotes(notes) {
  const bad = notes.filter(({ level }) => level > 0);
  const fine = notes.filter(({ level }) => level === 0);
  fill(byId("notes"), bad, note, notes.length ? "no complaints" : "no diagnostics");
  say(byId("fine"), `${fine.length} fine`);
  fill(byId("fine-notes"), fine, note, "");
}

function note({ level, name, text }) {
  const item = make("li", `${["✓", "!", "✗", "?"][level]} `, { class: `level${level}` });
  item.append(make("b", name), ` ${text}`);
  return item;
}

export function showFolder({ campaigns, reports, left_out: leftOut }) {
  fill(byId("campaigns"), campaigns, campaign, "none in the folder");
  fill(byId("reports"), reports, ({ path, text }) => {
    const item = make("li");
    const address = `reports/${path.split("/").map(encodeURIComponent).join("/")}`;
    item.append(make("a", path, { href: address, target: "_blank", rel: "noopener" }), make("small", text));
    return item;
  }, "none in the folder");
  if (leftOut) byId("reports").append(make("li", `${leftOut} more`, { class: "quiet" }));
}

function campaign({ path, plan, unit_id: unit, done, total, recording, next_run: next, problem }) {
  const item = make("li", `${path}: `);
  if (problem) {
    item.append(make("span", problem, { class: "bad" }));
    return item;
  }
  item.append(`${done} of ${total} runs`, make("progress", "", { value: done, max: Math.max(1, total) }));
  const now = recording ? `recording ${recording}` : done < total ? `next ${next}` : "complete";
  item.append(make("small", [now, `plan ${plan}`, unit && `unit ${unit}`].filter(Boolean).join(", ")));
  return item;
}
