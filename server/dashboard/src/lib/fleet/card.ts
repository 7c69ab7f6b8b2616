/** One arm at a glance: what its card says. Pure; times in s. */

import type { FleetRobot } from '../api/types';
import { spoken } from '../format';
import { ageText, STALE_AFTER } from '../live/age';
import { queueBadge } from '../queue/words';
import type { ArmNow } from '../stop/standing';

/** s without an answer after which nothing on the page counts as live. */
export const SILENT_AFTER = 3;

export type Tone = 'good' | 'warn' | 'bad' | 'quiet' | 'busy';

export interface Card {
  name: string;
  kind: string;
  /** The arm's state in one word, which is also the tone of the whole card. */
  tone: Tone;
  state: string;
  /** Why it is in that state; empty where nothing is to be said. */
  why: string;
  sample: string;
  isLive: boolean;
  queue: { tone: Tone; text: string };
  waiting: string;
  control: string;
  /** 0 to 1 while an experiment runs. */
  progress: number | null;
}

/** What is said of `robot`, `since` s after the service has told it. */
export function cardOf(robot: FleetRobot, since: number): Card {
  const isConnected = robot.connection === 'connected';
  const age = robot.sample_age === null ? null : robot.sample_age + since;
  const isHeard = since < SILENT_AFTER;
  const isLive = isHeard && isConnected && robot.sample_age !== null && robot.sample_age <= STALE_AFTER;
  const { queue } = robot;
  return {
    name: robot.robot,
    kind: robot.simulated === null ? 'not connected' : robot.simulated ? 'mock' : 'real arm',
    ...stateOf(robot, isHeard, isLive),
    sample: age === null ? 'no sample' : `sample ${ageText(age)} old`,
    isLive,
    queue: queueBadge(queue, isConnected),
    waiting: queue.queued === 1 ? '1 waiting' : `${queue.queued} waiting`,
    control: robot.control.holder === 'client' ? `${spoken(robot.control.name)} has control` : '',
    progress: queue.running === null ? null : (robot.progress ?? 0),
  };
}

function stateOf(robot: FleetRobot, isHeard: boolean, isLive: boolean): Pick<Card, 'tone' | 'state' | 'why'> {
  if (!isHeard) return { tone: 'bad', state: 'not known', why: 'The service does not answer.' };
  if (robot.connection === 'lost') return { tone: 'bad', state: 'link lost', why: robot.cause };
  if (robot.connection === 'connecting') return { tone: 'busy', state: 'connecting', why: '' };
  if (robot.connection === 'disconnected')
    return { tone: 'quiet', state: 'not connected', why: robot.connection_problem };
  if (robot.arm === 'fault') return { tone: 'bad', state: 'fault', why: robot.cause };
  if (robot.arm === 'stopped') return { tone: 'warn', state: 'stopped', why: robot.cause };
  const why = robot.queue.paused ? `queue paused: ${robot.queue.reason}` : robot.queue.waiting_for;
  if (!isLive) return { tone: 'warn', state: 'no fresh samples', why };
  if (robot.limp.length > 0)
    return {
      tone: 'warn',
      state: `limp: joint ${robot.limp.join(', ')}`,
      why: 'Nothing holds these joints.',
    };
  if (robot.activity !== 'none') return { tone: 'busy', state: robot.activity, why };
  const waits = robot.queue.paused && robot.queue.queued > 0;
  return { tone: waits ? 'warn' : 'good', state: robot.arm, why };
}

/** How many arms are in which condition, as one line. */
export function summary(cards: readonly Card[]): string {
  const counted = (tone: Tone): number => cards.filter((card) => card.tone === tone).length;
  const parts = [
    [counted('good'), 'idle'],
    [counted('busy'), 'busy'],
    [counted('warn'), 'to look at'],
    [counted('bad'), 'at fault or out of reach'],
    [counted('quiet'), 'not connected'],
  ] as const;
  const said = parts.filter(([count]) => count > 0).map(([count, what]) => `${count} ${what}`);
  return `${cards.length} arms: ${said.join(', ')}`;
}

/** What is known of an arm, or of all: for whether a stop still holds. */
export function armOf(robots: readonly FleetRobot[]): ArmNow {
  const known = robots.map((robot) =>
    robot.connection !== 'connected'
      ? 'unknown'
      : robot.arm === 'stopped' || robot.arm === 'fault'
        ? 'stopped'
        : 'free',
  );
  if (known.includes('free')) return 'free';
  return known.length === 0 || known.includes('unknown') ? 'unknown' : 'stopped';
}
