// The line to the server: words in, words out; one that breaks is tried again.

/** Open it; `hear` gets each word, `broken` is told of each break. */
export function line({ opened = () => {}, hear, broken = () => {} }) {
  let socket = null, wait = 250;
  const open = () => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/line`);
    socket.onopen = () => { wait = 250; opened(); };
    socket.onmessage = event => hear(JSON.parse(event.data));
    socket.onclose = () => {
      broken();
      setTimeout(open, wait);
      wait = Math.min(wait * 2, 4000);
    };
  };
  open();
  /** Say something; a line that is down takes nothing. */
  return said => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(said)); };
}
