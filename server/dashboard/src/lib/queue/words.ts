/** What the queue and the arm are doing, in words that hold together: nothing is called free that is held. Pure. */

import type { QueueStatus, RobotMessage } from '../api/types';
import { sentence } from '../format';

type Robot = Pick<RobotMessage, 'connection' | 'arm' | 'activity'>;
type Queue = Pick<QueueStatus, 'paused' | 'reason' | 'running' | 'waiting_for'>;

export const ACTIVITIES: Readonly<Record<Robot['activity'], string>> = {
  none: '',
  experiment: 'An experiment is running.',
  jog: 'It moves while somebody jogs it.',
  step: 'The arm is making a step.',
  program: 'A taught program is running.',
  lead: 'The arm is led by hand: hold it.',
};

/** What goes on, for the line above the charts. `waiting`: experiments in the queue. */
export function whatGoesOn(robot: Robot | null, queue: Queue | null, waiting: number): string {
  const activity = ACTIVITIES[robot?.activity ?? 'none'];
  const isHeld = robot?.connection === 'connected' && (robot.arm === 'stopped' || robot.arm === 'fault');
  const held = isHeld ? 'Nothing moves until the arm is reset.' : '';
  // Until the reset, the banner says why; the queue waits for the same reason.
  const paused = queue?.paused
    ? `The queue is paused. ${sentence(queue.reason)}`
    : sentence(queue?.waiting_for ?? '');
  const said = [activity || held, isHeld ? '' : paused].filter((part) => part !== '').join(' ');
  const isIdle = waiting === 0 && queue !== null && robot?.connection === 'connected';
  return said === '' && isIdle ? 'Nothing is running or waiting.' : said;
}

export interface Home {
  /** Which of the screens it is: each has one next step. */
  screen:
    | 'disconnected'
    | 'lost'
    | 'connecting'
    | 'ready'
    | 'waiting'
    | 'paused'
    | 'running'
    | 'stopped'
    | 'fault'
    | 'unknown';
  title: string;
}

/** Where the person stands: what the Live page says first. Experiments that are planned for later wait for nothing. */
export function homeOf(robot: Robot | null, queue: Queue | null): Home {
  if (robot === null) return { screen: 'unknown', title: 'Not known' };
  if (robot.connection === 'connecting') return { screen: 'connecting', title: 'Connecting' };
  if (robot.connection === 'lost') return { screen: 'lost', title: 'The link is lost' };
  if (robot.connection !== 'connected') return { screen: 'disconnected', title: 'No arm is connected' };
  if (robot.arm === 'fault') return { screen: 'fault', title: 'Fault' };
  if (robot.arm === 'stopped') return { screen: 'stopped', title: 'Stopped' };
  if (robot.activity === 'jog') return { screen: 'running', title: 'Under hand control' };
  if (robot.activity !== 'none') return { screen: 'running', title: 'Moving' };
  if (queue?.paused) return { screen: 'paused', title: 'The queue is paused' };
  return queue?.waiting_for ? { screen: 'waiting', title: 'Waiting' } : { screen: 'ready', title: 'Ready' };
}

/** The run after which the queue was paused: its reason is the first sentence of the queue's. */
export function pausedBy<Run extends { reason: string }>(
  queue: Queue | null,
  ended: readonly Run[],
): Run | null {
  if (!queue?.paused) return null;
  return ended.find((one) => one.reason !== '' && queue.reason.startsWith(`${one.reason}. `)) ?? null;
}

/** Why the queue does what it does. `isConnected`: whether there is an arm to move. `told`: a first sentence that stands elsewhere. */
export function queueState(queue: Queue, isConnected: boolean, told = ''): { head: string; text: string } {
  if (queue.paused) {
    const goesOn = queue.running ? ' The experiment that is running goes on to its end.' : '';
    const reason = told === '' ? queue.reason : queue.reason.replace(`${told}. `, '');
    return { head: 'Paused:', text: `${reason}.${goesOn}` };
  }
  if (queue.waiting_for) return { head: 'Waiting:', text: `${queue.waiting_for}.` };
  if (queue.running) return { head: '', text: 'One experiment is running.' };
  if (!isConnected) return { head: '', text: 'Nothing can run until the robot is connected.' };
  return { head: '', text: 'Experiments run one at a time, when their turn comes.' };
}

/** A sign and a word for the queue. */
export function queueBadge(
  queue: Queue | null,
  isConnected: boolean,
): { tone: 'good' | 'warn' | 'busy' | 'quiet'; text: string } {
  if (queue === null) return { tone: 'quiet', text: 'not known' };
  if (queue.running) return { tone: 'busy', text: queue.paused ? 'running the last one' : 'running' };
  if (queue.paused) return { tone: 'warn', text: 'paused' };
  if (queue.waiting_for) return { tone: 'warn', text: 'waiting' };
  return isConnected ? { tone: 'good', text: 'ready' } : { tone: 'quiet', text: 'no robot' };
}
