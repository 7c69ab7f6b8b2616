/** What the shell shows in each scene: the state of the connection and of the arm, as the service would say it. */

import { showRobot } from '../lib/api/client';
import type { QueueStatus, RobotMessage, SampleMessage } from '../lib/api/types';
import { live } from '../lib/live/live.svelte';

export const SCENES = [
  'parts',
  'ready',
  'running',
  'stopped',
  'fault',
  'stale',
  'link',
  'lost',
  'off',
] as const;
export type Scene = (typeof SCENES)[number];

const ROBOT = {
  connection: 'connected',
  connection_problem: '',
  identity: { simulated: true },
  arm: 'idle',
  cause: '',
  stop: 4,
  activity: 'none',
  experiment: null,
  limp: [],
  control: { holder: 'none', name: '' },
} as unknown as RobotMessage;

const CHANGES: Readonly<Record<Scene, Partial<RobotMessage>>> = {
  parts: {},
  ready: {},
  running: { arm: 'running', activity: 'experiment' },
  stopped: { arm: 'stopped', cause: 'on request, by STOP on the page or daq stop' },
  fault: { arm: 'fault', cause: 'joint 2 is 131 counts from its set point; allowed are 127' },
  stale: {},
  link: { connection: 'lost', cause: 'no answer for 2 s' },
  lost: {},
  off: { connection: 'disconnected' },
};

/** Sets what is known of the service, as its messages would. */
export function begin(scene: Scene): void {
  showRobot('ma2000');
  live.me = {
    name: 'local',
    role: 'owner',
    owner_of: ['ma2000'],
  } as unknown as typeof live.me;
  live.robot = { ...ROBOT, ...CHANGES[scene] };
  live.queue = {
    paused: false,
    reason: 'anna paused it',
    queued: 2,
    running: null,
    waiting_for: '',
  } as unknown as QueueStatus;
  live.sample = {
    tick: 1,
    joints: [1],
    position: [0],
    set_point: [0],
    error: [0],
  } as unknown as SampleMessage;
  live.sampleAge = scene === 'stale' ? 3.2 : 0.02;
  live.silence = 0.02;
  live.rate = 50;
  live.now = 100;
  live.socket =
    scene === 'lost'
      ? { phase: 'lost', attempt: 3, why: 'the service does not answer', retryAt: 104 }
      : { phase: 'open', again: false };
}
