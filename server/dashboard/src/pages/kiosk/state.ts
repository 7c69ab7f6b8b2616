/** What the screen at the arm says in one word, readable from across the room. Nothing old is said as if it were so. Pure. */

import type { QueueStatus, RobotMessage } from '../../lib/api/types';
import { ageText } from '../../lib/live/age';
import { homeOf } from '../../lib/queue/words';

export interface KioskState {
  readonly word: string;
  readonly tone: 'good' | 'busy' | 'warn' | 'bad' | 'quiet';
  /** A sign beside the colour. */
  readonly sign: string;
}

const LOOKS: Readonly<Record<ReturnType<typeof homeOf>['screen'], Omit<KioskState, 'word'>>> = {
  ready: { tone: 'good', sign: '●' },
  running: { tone: 'busy', sign: '◐' },
  waiting: { tone: 'warn', sign: '▲' },
  paused: { tone: 'warn', sign: '▲' },
  stopped: { tone: 'warn', sign: '▲' },
  fault: { tone: 'bad', sign: '■' },
  disconnected: { tone: 'quiet', sign: '○' },
  lost: { tone: 'bad', sign: '■' },
  connecting: { tone: 'quiet', sign: '○' },
  unknown: { tone: 'quiet', sign: '○' },
};

/** `isStale`: whether no samples come; `isOpen`: whether the service is heard. Ages in s. */
export function kioskState(
  robot: RobotMessage | null,
  queue: QueueStatus | null,
  at: { isOpen: boolean; isStale: boolean; age: number | null },
): KioskState {
  if (!at.isOpen) return { word: 'Not known', tone: 'warn', sign: '▲' };
  const { screen, title } = homeOf(robot, queue);
  const isConnected = robot?.connection === 'connected';
  if (isConnected && at.isStale) return { word: 'Not known', tone: 'warn', sign: '▲' };
  return { word: screen === 'paused' ? 'Queue paused' : title, ...LOOKS[screen] };
}

/** How old what is shown is. */
export function ageLine(at: { isOpen: boolean; isStale: boolean; age: number | null }): string {
  if (!at.isOpen) return `No connection to the service; newest sample ${ageText(at.age)} old`;
  if (at.age === null) return 'No sample yet';
  return at.isStale ? `NOT LIVE: newest sample ${ageText(at.age)} old` : `Live, ${ageText(at.age)} old`;
}
