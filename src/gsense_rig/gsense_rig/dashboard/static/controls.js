// Buttons and forms: commands go out, answers come in.

import { byId, make, say } from "./dom.js";

const SHOWN = 5; // answers

export class Controls {
  constructor(connection) {
    this.connection = connection;
    this.names = new Map(); // id -> what was asked for
    byId("stop").addEventListener("click", () => this.ask("stop", {}, "stop"));
    document.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.ask("stop", {}, "stop");
    });
    for (const button of document.querySelectorAll("[data-call]")) {
      button.addEventListener("click", () => this.ask(button.dataset.call, {}, button.textContent));
    }
    this.form("sinusoid", ["amplitude", "angular_frequency", "cycles"], {});
    this.form("move", ["position"], { shape: "hold", duration: 0 });
  }

  form(name, fields, fixed) {
    const form = byId(name);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const values = {};
      for (const field of fields) {
        values[field] = Number(form.elements[field].value.trim().replace(",", "."));
        if (form.elements[field].value.trim() === "" || Number.isNaN(values[field])) {
          this.note("refused", `${field.replace("_", " ")} is not a number`);
          return;
        }
      }
      this.ask(name, { ...fixed, ...values }, name);
    });
  }

  ask(type, fields, name) {
    const id = this.connection.command(type, fields);
    if (id === null) this.note("failed", `${name} not sent: no connection to the dashboard`);
    else this.names.set(id, name);
  }

  /** An answer of the server. */
  answer({ id, state, text }) {
    const name = this.names.get(id) ?? "";
    if (state !== "accepted") this.names.delete(id);
    this.note(state, [name, state].filter(Boolean).join(" ") + (text ? `: ${text}` : ""));
  }

  note(state, text) {
    const kind = { refused: "bad", failed: "bad", done: "good" }[state] ?? "";
    byId("answers").prepend(make("li", text, { class: kind }));
    while (byId("answers").children.length > SHOWN) byId("answers").lastChild.remove();
  }

  /** What the state allows. The rig judges again, whatever is pressed. */
  show(state) {
    const mode = state.rig && !state.rig.silent ? state.rig.mode : "";
    const may = state.may_command && !state.refusal;
    for (const button of document.querySelectorAll("form button, [data-call=park]")) button.disabled = !(may && mode === "IDLE");
    document.querySelector("[data-call=home]").disabled = !(may && ["UNHOMED", "IDLE"].includes(mode));
    document.querySelector("[data-call=reset]").disabled = !(may && mode === "FAULT");
    const motions = state.motions.map(({ text, elapsed, mine }) =>
      `${text}${elapsed ? `, ${elapsed.toFixed(1)} s` : ""}${mine ? "; stops with this page" : "; of another page"}`);
    say(byId("under-way"), [state.refusal, ...motions].filter(Boolean).join(" · "));
  }

  /** Without a connection nothing can be sent. */
  lost() {
    for (const button of document.querySelectorAll("form button, [data-call]")) button.disabled = true;
    say(byId("under-way"), "");
  }
}
