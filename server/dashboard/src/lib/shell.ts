/** The offline shell: a page that opens without the service, and says that nothing is live. */

/** ms after the page is loaded: charts and 3-D come first. */
const WHEN_QUIET = 4000;

/**
 * Has the browser keep the shell (`public/sw.js`), once the page itself is there. Only a page that
 * came over TLS or from this computer may.
 */
export function keepShell(): void {
  if (!('serviceWorker' in navigator)) return;
  const register = (): void => void navigator.serviceWorker.register('./sw.js').catch(() => {});
  addEventListener('load', () => setTimeout(register, WHEN_QUIET));
}
