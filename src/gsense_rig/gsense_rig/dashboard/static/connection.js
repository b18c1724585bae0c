// The websocket: connects, says who the page is, answers every state it has been drawn from, connects again.

const RETRY = 1000; // ms

/** The token behind `#` of the address; kept for this tab, so that a reload needs it no more. */
function token() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found) {
    sessionStorage.setItem("token", found);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}

export class Connection {
  /** `heard` takes each message; `changed` whether there is a connection. */
  constructor(heard, changed) {
    this.heard = heard;
    this.changed = changed;
    this.token = token();
    this.ids = 0;
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    this.socket = socket;
    socket.onopen = () => {
      this.send({ type: "hello", token: this.token });
      this.changed(true);
    };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      this.heard(message);
      if (message.type === "state") this.send({ type: "alive", n: message.n });
    };
    socket.onclose = () => {
      this.changed(false);
      setTimeout(() => this.open(), RETRY);
    };
  }

  /** False without a connection. */
  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Send a command; its answers carry the id that this returns. Null without a connection. */
  command(type, fields) {
    this.ids += 1;
    return this.send({ type, id: this.ids, ...fields }) ? this.ids : null;
  }
}
