/**
 * What has to be known before anything is shown, asked for all at once, and the live socket. `main.ts` asks before the
 * program of the page is loaded, so that the service answers while the browser reads it.
 */

import { api, ask, here, root, showRobot } from '../api/client';
import { EarlySocket } from '../api/early_socket';
import { Problem } from '../api/problem';
import type { Machine, Me, SystemStatus } from '../api/types';

export interface Asked {
  /** The robot's name; from then on `here()` tells it. */
  readonly robot: Promise<string>;
  readonly machine: Promise<Machine>;
  readonly me: Promise<Me>;
  readonly system: Promise<SystemStatus>;
  /** Subscribed to everything. */
  readonly socket: Promise<EarlySocket>;
}

let early: Asked | null = null;

/** Asks ahead of whoever will want to know. */
export function askEarly(): void {
  early = askAll();
}

/** What was asked early, once; asked now after that. Every answer may be a Problem instead. */
export function asked(): Asked {
  const found = early ?? askAll();
  early = null;
  return found;
}

export async function askSystem(): Promise<SystemStatus> {
  return ask(api.GET('/api/v1/system'));
}

/** The live socket of the robot. */
export async function newSocket(robot: string | Promise<string>): Promise<EarlySocket> {
  const [{ ticket }, name] = await Promise.all([ask(api.POST('/api/v1/tickets')), robot]);
  const path = `/api/v1/robots/${encodeURIComponent(name)}/live?ticket=${ticket}`;
  const first = { subscribe: ['samples', 'robot', 'link', 'queue', 'jobs', 'events', 'teaching'] } as const;
  return new EarlySocket(new WebSocket(root.replace(/^http/, 'ws') + path), JSON.stringify(first));
}

function askAll(): Asked {
  const system = askSystem(); // the second door of a stop: nothing is asked before it
  const robot = chosenRobot();
  const found: Asked = {
    robot,
    machine: robot.then(() => ask(api.GET('/api/v1/robots/{robot}/machine', { params: { path: here() } }))),
    me: ask(api.GET('/api/v1/me')),
    system,
    socket: newSocket(robot),
  };
  // A refusal is told to whoever waits for the answer; until then nobody has missed it.
  for (const answer of Object.values(found) as Promise<unknown>[]) answer.catch(() => {});
  return found;
}

/** The robot that the address names (`?robot=left`), or the first one. */
async function chosenRobot(): Promise<string> {
  const all = (await ask(api.GET('/api/v1/robots'))).map((one) => one.robot);
  const chosen = new URLSearchParams(location.search).get('robot') ?? all[0];
  if (chosen === undefined) throw new Problem(404, 'not-found', 'this service has no robot');
  if (!all.includes(chosen)) {
    throw new Problem(404, 'not-found', `this service has no robot ${chosen}`, `it has ${all.join(', ')}`);
  }
  showRobot(chosen, all);
  return chosen;
}
