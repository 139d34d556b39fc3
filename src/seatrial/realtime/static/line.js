// The WebSocket to the server: JSON messages both ways, with reconnection.

// Closed by the server for good: the page was opened again in another window, or lacks the key.
const FOR_GOOD = [4001, 4003];
const REASONS = { 1001: "the program has ended", 1012: "the program has ended", 1006: "the connection was lost" };

/** Open it; `hear` gets each message, `broken` the reason of each break and whether it is final. */
export function line({ opened = () => {}, hear, broken = () => {} }) {
  let socket = null, wait = 250;
  const open = () => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/line`);
    socket.onopen = () => { wait = 250; opened(); };
    socket.onmessage = event => hear(JSON.parse(event.data));
    socket.onclose = ({ code, reason }) => {
      const ever = FOR_GOOD.includes(code);
      broken(reason || REASONS[code] || "the connection was closed", ever);
      if (ever) return;
      setTimeout(open, wait);
      wait = Math.min(wait * 2, 4000);
    };
  };
  open();
  /** Send a message; it is discarded while there is no connection. */
  return said => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(said)); };
}
