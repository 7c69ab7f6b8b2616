/** Calls when the browser has nothing better to do, after `latest` ms at the latest. Returns what calls it off. */
export function whenIdle(call: () => void, latest: number): () => void {
  // Not every browser tells when it is idle; then it is asked a little later.
  if (typeof requestIdleCallback === 'undefined') {
    const timer = setTimeout(call, latest / 4);
    return () => clearTimeout(timer);
  }
  const asked = requestIdleCallback(call, { timeout: latest });
  return () => cancelIdleCallback(asked);
}

/** Calls once the next picture of the page is on the screen. Returns what calls it off. */
export function afterPaint(call: () => void): () => void {
  let timer: ReturnType<typeof setTimeout>;
  const frame = requestAnimationFrame(() => (timer = setTimeout(call)));
  return () => {
    cancelAnimationFrame(frame);
    clearTimeout(timer);
  };
}
