// The line to the server: words in, words out; one that breaks is tried again.

// Closed by the server for good: the page was opened again in another window, or has not the key.
const FOR_GOOD = [4001, 4003];
const REASONS = { 1001: "the program has ended", 1012: "the program has ended", 1006: "the line broke" };

/** Open it; `hear` gets each word, `broken` is told of each break why, and whether that is for good. */
export function line({ opened = () => {}, hear, broken = () => {} }) {
  let socket = null, wait = 250;
  const open = () => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/line`);
    socket.onopen = () => { wait = 250; opened(); };
    socket.onmessage = event => hear(JSON.parse(event.data));
    socket.onclose = ({ code, reason }) => {
      const ever = FOR_GOOD.includes(code);
      broken(reason || REASONS[code] || "the line was closed", ever);
      if (ever) return;
      setTimeout(open, wait);
      wait = Math.min(wait * 2, 4000);
    };
  };
  open();
  /** Say something; a line that is down takes nothing. */
  return said => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(said)); };
}
