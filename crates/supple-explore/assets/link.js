"use strict";
// The channel to the program: requests go by POST, answers come by a WebSocket.
window.Explore = { counts: {} };
(function (E) {
  const token = document.querySelector("meta[name=token]").content;
  let page = null;
  let socket = null;
  let wait = 500;
  // Numbers grow over the life of the page, also across lost channels.
  let number = 0;

  function open(listener) {
    socket = new WebSocket(`ws://${location.host}/channel?token=${token}`);
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.kind === "hello" && message.page !== undefined) {
        page = message.page;
        wait = 500;
      }
      listener(message);
    };
    socket.onclose = () => {
      page = null;
      listener({ kind: "lost" });
      // The program may have ended: tries become rare.
      setTimeout(() => open(listener), wait);
      wait = Math.min(2 * wait, 30000);
    };
  }

  async function post(path, body) {
    const joint = path.includes("?") ? "&" : "?";
    return fetch(`${path}${joint}token=${token}`, { method: "POST", body, cache: "no-store" });
  }

  // By view with a request on its way: the text of the newest one that waits, or null.
  const waiting = new Map();

  /** Sends a request; of those that come while one of the same view is on its way only the newest is sent after it. */
  function send(view, text) {
    if (waiting.has(view)) {
      waiting.set(view, text);
      return;
    }
    waiting.set(view, null);
    // Where the program has gone, the channel tells it.
    post(`/ask?page=${page}`, text).then(async (answer) => {
      if (answer.status === 400) E.tools.notice("request", await answer.text());
    }, () => {}).then(() => {
      const next = waiting.get(view);
      waiting.delete(view);
      if (next !== null && page !== null) send(view, next);
    });
  }

  /** Asks something; returns the number of the request. Newer requests of one view take the place of older ones. */
  function ask(view, body) {
    number += 1;
    E.counts[view] = (E.counts[view] || 0) + 1;
    if (page === null) return number;
    // Each kind of work is stopped by a request of its own.
    const kind = view === "stop" ? `stop ${body.what}` : view;
    send(kind, JSON.stringify({ view, id: number, generation: E.design.generation, ...body }));
    return number;
  }

  /** Reads the task file again; the text of an error where that fails. */
  async function reload() {
    const answer = await post("/reload", "");
    return answer.ok ? null : answer.text();
  }

  E.link = { open, ask, reload };
})(window.Explore);
