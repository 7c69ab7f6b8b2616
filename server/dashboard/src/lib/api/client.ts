/**
 * The service's API, typed by its own description.
 *
 *   const machine = await ask(api.GET('/api/v1/robots/{robot}/machine', { params: { path: here() } }));
 *
 * `ask` gives the answer's data, or throws a Problem.
 */

import createClient from 'openapi-fetch';
import { notAnswered, Problem, problemOf } from './problem';
import type { paths } from './schema';
import { currentToken } from './token';
import type { Health, Told } from './types';

/** The address of the service, at whose root this page is: a proxy may serve both below a path of its own. */
export const root = location.origin + location.pathname.replace(/\/[^/]*$/, '');
export const api = createClient<paths>({ baseUrl: root });

api.use({
  onRequest({ request }) {
    const token = currentToken();
    if (token !== null) request.headers.set('Authorization', `Bearer ${token}`);
    return request;
  },
});

let robot = '';
let robots: readonly string[] = [];

/** The robot that this page shows: the part `robot` of an address. */
export function here(): { robot: string } {
  return { robot };
}

/** Whether the service has several robots. */
export function isFleet(): boolean {
  return robots.length > 1;
}

/** Chooses the robot out of `all`; called once, before anything else is shown. Another one is another address. */
export function showRobot(name: string, all: readonly string[] = [name]): void {
  robot = name;
  robots = all;
}

/** The address of this page for another robot: the page is loaded anew, so that nothing of this one is left in it. */
export function pageOf(name: string, page: string): string {
  return `?robot=${encodeURIComponent(name)}#/${page}`;
}

/** A key under which a request is carried out once. Not `randomUUID`: that one exists only on pages that came over TLS or
 * from this computer. */
export function newKey(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) =>
    byte.toString(16).padStart(2, '0'),
  ).join('');
}

interface Answer<T> {
  data?: T;
  error?: unknown;
  response: Response;
}

/** The data of an answer. Throws a Problem. */
export async function ask<T>(request: Promise<Answer<T>>): Promise<Told<T>> {
  let answer: Answer<T>;
  try {
    answer = await request;
  } catch (error) {
    throw error instanceof Problem || (error instanceof DOMException && error.name === 'AbortError')
      ? error
      : notAnswered();
  }
  if (!answer.response.ok) throw problemOf(answer.response.status, answer.error);
  return answer.data as Told<T>;
}

/** How the service is. One that is not ready says so with a 503, whose body is what is wanted. Throws a Problem. */
export async function readiness(): Promise<Health> {
  const answer = await fetch(`${root}/readyz`, { headers: authorization() }).catch(() => {
    throw notAnswered();
  });
  const body: unknown = await answer.json().catch(() => null);
  if (!(answer.ok || answer.status === 503) || body === null) throw problemOf(answer.status, body);
  return body as Health;
}

function authorization(): HeadersInit {
  const token = currentToken();
  return token === null ? {} : { Authorization: `Bearer ${token}` };
}

/** The address of a file to download: a picture, a trace. With a token the file is fetched first: see `download`. */
export function addressOf(path: string): string {
  return `${root}/api/v1/robots/${encodeURIComponent(robot)}${path}`;
}

/** Saves a file of the service under a name of its own. Throws a Problem. */
export async function download(path: string, name: string): Promise<void> {
  const answer = await fetch(addressOf(path), { headers: authorization() }).catch(() => {
    throw notAnswered();
  });
  if (!answer.ok) throw problemOf(answer.status, await answer.json().catch(() => null));
  saveAs(await answer.blob(), name);
}

/** Has the browser save data as a file. */
export function saveAs(data: Blob, name: string): void {
  const address = URL.createObjectURL(data);
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
