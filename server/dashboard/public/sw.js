// The offline shell. Without the service the page still opens, with Stop, and says that nothing can be reached: it has no
// data, since nothing of the API is ever kept.
//
// No request but for the page itself passes through here: a stop must not wait until a browser has started this worker.
// Where a browser cannot be told so (addRoutes), there is no worker.

const KEPT = 'shell';
const PAGE = new URL('./', self.location.href).href;

/** Keeps a page as it came, with the files that it names; what earlier ones named goes. */
async function keep(answer) {
  if (!answer.ok) return;
  const cache = await caches.open(KEPT);
  const text = await answer.clone().text();
  const parts = [...text.matchAll(/(?:href|src)="(\.\/[^"]+)"/g)].map(([, name]) => new URL(name, PAGE).href);
  const there = (await cache.keys()).map((request) => request.url);
  await cache.addAll(parts.filter((part) => !there.includes(part)));
  await cache.put(PAGE, answer);
  await Promise.all(
    there.filter((url) => url !== PAGE && !parts.includes(url)).map((url) => cache.delete(url)),
  );
}

/** The page from the service; the kept one if there is no answer. */
async function page(event) {
  try {
    const answer = (await event.preloadResponse) ?? (await fetch(event.request));
    event.waitUntil(keep(answer.clone()));
    return answer;
  } catch {
    return (await caches.match(PAGE)) ?? Response.error();
  }
}

self.addEventListener('install', (event) => {
  if (!event.addRoutes) {
    event.waitUntil(self.registration.unregister());
    return;
  }
  event.waitUntil(
    Promise.all([
      event.addRoutes([
        { condition: { requestMode: 'navigate' }, source: 'fetch-event' },
        ...['*/assets/*', '*/icon.svg'].map((pathname) => ({
          condition: { urlPattern: new URLPattern({ pathname }) },
          source: 'cache',
        })),
        { condition: { urlPattern: new URLPattern({}) }, source: 'network' },
      ]),
      fetch(PAGE).then(keep),
    ]),
  );
});

self.addEventListener('activate', (event) => event.waitUntil(self.registration.navigationPreload.enable()));

self.addEventListener('fetch', (event) => {
  const asked = event.request.url.replace(/[?#].*/, '');
  if (event.request.mode === 'navigate' && asked === PAGE) event.respondWith(page(event));
});
