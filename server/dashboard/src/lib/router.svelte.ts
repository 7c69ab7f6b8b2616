/** Which page is shown: the part of the address behind `#`, such as `#/traces/42?joint=2`. */

export interface Route {
  /** The page: the first part. */
  page: string;
  /** The parts that follow. */
  rest: string[];
  query: URLSearchParams;
}

/** Splits what stands behind `#`. */
export function routeOf(hash: string): Route {
  const [path = '', query = ''] = hash.replace(/^#\/?/, '').split('?');
  const [page = '', ...rest] = path.split('/').map(decodeURIComponent);
  return { page, rest: rest.filter((part) => part !== ''), query: new URLSearchParams(query) };
}

/** The address of a page, for `href`. */
export function linkTo(page: string, ...rest: string[]): string {
  return `#/${[page, ...rest].map(encodeURIComponent).join('/')}`;
}

class Router {
  route = $state.raw<Route>(routeOf(''));

  start(): void {
    this.read();
    addEventListener('hashchange', () => this.read());
  }

  /** Takes over the address as it is now. */
  read(): void {
    const before = this.route.page;
    this.route = routeOf(location.hash);
    if (before !== this.route.page) scrollTo(0, 0); // another page begins at its top
  }

  /** A page with a query, such as `#/experiments?again=42`. */
  ask(page: string, query: Record<string, string>): void {
    location.hash = `${linkTo(page)}?${new URLSearchParams(query)}`;
  }

  /** Takes the place of the address now. Read afterwards: Svelte would mount a page anew that is read amid effects. */
  replace(page: string, ...rest: string[]): void {
    history.replaceState(null, '', linkTo(page, ...rest));
    queueMicrotask(() => this.read());
  }

  go(page: string, ...rest: string[]): void {
    location.hash = linkTo(page, ...rest);
  }
}

export const router = new Router();
