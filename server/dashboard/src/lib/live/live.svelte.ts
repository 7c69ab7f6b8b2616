/**
 * What the service says live, for every page: `live.robot`, `live.queue`, `live.sample` and their ages.
 *
 * Samples arrive fifty times a second. `live.recording` and `live.newest` have them at once, without being reactive;
 * what is shown as numbers (`live.sample`) follows ten times a second. Charts draw in `onFrame`.
 */

import { api, ask, here, isFleet } from '../api/client';
import { asProblem, type Problem } from '../api/problem';
import { spoken } from '../format';
import { isMissing, LiveSocket, SILENT_AFTER, type Socket, type SocketState } from '../api/socket';
import type {
  Experiment,
  Job,
  LiveFrame,
  LiveMessage,
  LiveRequest,
  Machine,
  Me,
  ProgressMessage,
  QueueStatus,
  RobotMessage,
  SampleMessage,
  ServiceEvent,
  SystemStatus,
} from '../api/types';
import { LinkHealth, NOT_OPEN } from '../link/health';
import { armNow, isResetOver } from '../stop/standing';
import { fleet } from '../fleet/fleet.svelte';
import { stop } from '../stop/stop.svelte';
import { ServiceClock, STALE_AFTER } from './age';
import { asked, askSystem, newSocket } from './asked';
import { endReason, newestEvents, withPauser, withStopper } from './events';
import { SampleRate } from './rate';
import { Recording } from './recording';

const SHOWN_EVERY = 100;
/** s of samples that are kept, and s that are asked for at the start. */
const KEPT = 300;
const AT_START = 60;
/** ms: the past is much to send and to read, and the newest sample must not wait for it. */
const PAST_AFTER = 100;
const POINTS = 1200;
const EVENTS_KEPT = 100;
const EVENTS_ASKED = 30;
const LINES_KEPT = 20;
/** s until the service is asked again what it has not said about itself. */
const SYSTEM_AGAIN = 10;

/** s of control, of the original controller; gaps are told by ticks, so that another one does no harm. */
const PERIOD = 0.02;
/** s by which the service's clock may seem to go back before its computer is taken to have been started anew. */
const CLOCK_SLACK = 1;

function jointsOf(count: number): number[] {
  return Array.from({ length: count }, (_, index) => index + 1);
}

const seconds = (): number => performance.now() / 1000;

class Live {
  socket = $state.raw<SocketState>({ phase: 'connecting', attempt: 0 });
  /**
   * How often the connection has come back. Whoever has loaded a list reads it in an effect and loads anew when it
   * changes: messages about what happened meanwhile do not come later.
   */
  healed = $state(0);
  /** Set when the page cannot be used at all: no token, no service. */
  problem = $state.raw<Problem | null>(null);
  machine = $state.raw<Machine | null>(null);
  me = $state.raw<Me | null>(null);
  /** Whether a real arm may run while nobody says to be there. */
  isUnattended = $state(false);
  /** Whether the service has other robots, too. */
  isOfSeveral = $state(false);
  private toldRobot = $state.raw<RobotMessage | null>(null);
  private toldQueue = $state.raw<QueueStatus | null>(null);
  /** How the link does, in the same words on every page. */
  link = $state.raw(NOT_OPEN);
  /** How far the experiment is that runs; null when none does. */
  progress = $state.raw<ProgressMessage | null>(null);
  /** The newest jobs' last messages, by number. Load the list from the API, then follow changes here. */
  jobs = $state.raw<ReadonlyMap<string, Job>>(new Map());
  /** What happened, the newest first. */
  events = $state.raw<readonly ServiceEvent[]>([]);
  robot: RobotMessage | null = $derived(
    withStopper(this.toldRobot, this.events, (name, at) => this.who(name, at)),
  );
  queue: QueueStatus | null = $derived(
    withPauser(this.toldQueue, this.events, (name, at) => this.who(name, at)),
  );
  /** Lines for whoever teaches, the newest last. */
  lines = $state.raw<readonly string[]>([]);
  /** The last refusal of something that was sent over the socket. */
  refused = $state.raw<string>('');
  /** The newest sample, ten times a second. */
  sample = $state.raw<SampleMessage | null>(null);
  /** s; null before the first sample. */
  sampleAge = $state<number | null>(null);
  /** s since the service has said anything. */
  silence = $state<number | null>(null);
  /** s, this page's clock, a few times a second: for whatever shows an age. */
  now = $state(seconds());
  /** Largest lateness of samples in the last second, s. */
  jitter = $state<number | null>(null);
  /** Samples a second, Hz; null while none arrive. */
  rate = $state<number | null>(null);
  /** Whether the service has lately left out samples for this page, which did not take them in time. */
  isThinned = $state(false);
  isOpen: boolean = $derived(this.socket.phase === 'open');
  /** Whether there is no connection where there was one, or should be. */
  isMissing: boolean = $derived(isMissing(this.socket, this.silence !== null));
  /** Whether what is shown is not what is: no connection, or no samples although the robot is connected. */
  isStale: boolean = $derived(!this.isOpen || this.sampleAge === null || this.sampleAge > STALE_AFTER);
  /** What the banner says of the arm: why it was stopped, or is at fault. A lost link is told with every run it ended. */
  private bannerCause = $derived(
    this.robot?.connection === 'connected' && (this.robot.arm === 'stopped' || this.robot.arm === 'fault')
      ? this.robot.cause
      : '',
  );
  /** Whether an order may move the arm: it is there, and neither stopped nor at fault. */
  canMove: boolean = $derived(
    this.isOpen &&
      this.robot?.connection === 'connected' &&
      this.robot.arm !== 'stopped' &&
      this.robot.arm !== 'fault',
  );
  isOperator: boolean = $derived(this.me !== null && this.me.role !== 'viewer');
  /** Whether the caller may change what others have submitted to this robot. */
  isOwner: boolean = $derived(this.me?.owner_of.includes(here().robot) ?? false);
  isRealArm: boolean = $derived(this.robot?.identity?.simulated === false);
  /** Whether something runs that is ended unless an operator says to be there. */
  needsAttendance: boolean = $derived(this.isRealArm && !this.isUnattended && !!this.queue?.running);

  /** Panels of plug-ins: where the module of each title is. */
  panels = $state.raw<Readonly<Record<string, string>>>({});
  /** Parts of the page whose routes the service has from plug-ins; none before it has said so. */
  pages = $state.raw<ReadonlySet<string>>(new Set());

  readonly clock = new ServiceClock();
  recording: Recording | null = null;
  newest: SampleMessage | null = null;
  private listeners = new Set<(message: LiveMessage) => void>();
  private lateness: number[] = [];
  private readonly received = new SampleRate();
  private readonly health = new LinkHealth();
  private connection: LiveSocket | null = null;

  /** Asks who and what there is, then listens for as long as the page lives. Returns once it is known. */
  async start(): Promise<void> {
    setInterval(() => this.tick(), SHOWN_EVERY);
    await this.begin();
  }

  /** Tries at once to reach the service. */
  retryNow(): void {
    if (this.connection === null) void this.begin();
    else this.connection.retryNow();
  }

  /** Sends over the socket. Whether it was open. */
  send(request: LiveRequest): boolean {
    return this.connection?.send(request) ?? false;
  }

  /** Calls back at every message, at once. Returns what ends it. */
  onMessage(call: (message: LiveMessage) => void): () => void {
    this.listeners.add(call);
    return () => this.listeners.delete(call);
  }

  /** Whether the caller may change and cancel what belongs to `owner`. */
  mayChange(owner: string): boolean {
    return this.isOperator && (this.isOwner || this.me?.name === owner);
  }

  /** A name as the person at this page reads it. `stoppedAt`: when that person pressed Stop, which everybody at the
   * service's computer may have done: of them, only who pressed it here is the reader. */
  who(name: string | null | undefined, stoppedAt?: string): string {
    const isHere = name !== 'local' || stoppedAt === undefined || stop.wasPressedAt(stoppedAt);
    return name == null ? 'unknown' : name === this.me?.name && isHere ? 'you' : spoken(name);
  }

  /** Why an experiment ended, as the person at this page reads it. */
  reasonOf(ended: Experiment): string {
    return endReason(ended, this.events, (name, at) => this.who(name, at));
  }

  /** Time of day at the service, ms since 1970. Reactive: it grows. */
  get wall(): number {
    return this.clock.wall(this.now) ?? Date.now();
  }

  /** s since `hostTime` of the service's clock. Reactive: it grows. */
  ageOf(hostTime: number): number | null {
    return this.clock.age(hostTime, this.now);
  }

  private async begin(): Promise<void> {
    const { robot, machine, me, system, socket } = asked();
    try {
      await robot;
      this.isOfSeveral = isFleet();
      if (this.isOfSeveral) fleet.start();
      const [known, caller] = await Promise.all([machine, me]);
      this.me = caller;
      void this.learn(system);
      this.problem = null;
      this.recording = new Recording(jointsOf(known.joints.length), PERIOD, KEPT);
      this.machine = known;
      this.connection = this.connect(socket);
      this.connection.start();
    } catch (error) {
      socket.then((one) => one.close()).catch(() => {});
      this.problem = asProblem(error);
      if (this.problem.status === 0 || this.problem.status >= 500) setTimeout(() => this.retryNow(), 2000);
    }
  }

  /** What the page can do without, so that nothing waits for it: without it a stop has one door less. */
  private async learn(system: Promise<SystemStatus>): Promise<void> {
    try {
      const known = await system;
      stop.port = known.stop_port;
      this.panels = known.panels;
      this.pages = new Set(known.pages);
      // Of several arms some may: to say to be there does no harm then.
      this.isUnattended = known.unattended && !isFleet();
    } catch {
      setTimeout(() => void this.learn(askSystem()), SYSTEM_AGAIN * 1000);
    }
  }

  /** What happened before the connection opened: who stopped the arm is among it. */
  private async learnEvents(): Promise<void> {
    const params = { path: here(), query: { limit: EVENTS_ASKED } };
    const before = await ask(api.GET('/api/v1/robots/{robot}/events', { params })).catch(() => null);
    if (before !== null) this.events = newestEvents(this.events, before.items, EVENTS_KEPT);
  }

  /** `first`: the first connection. */
  private connect(first: Promise<Socket>): LiveSocket {
    let given: Promise<Socket> | null = first;
    return new LiveSocket({
      open: () => {
        const socket = given ?? newSocket(here().robot);
        given = null;
        return socket.then(
          (opened) => this.admitted(opened),
          (error: unknown) => this.notAdmitted(error),
        );
      },
      frame: (frame, at) => this.hear(frame, at),
      state: (state) => {
        this.socket = state;
        if (state.phase !== 'open') return;
        if (state.again) this.healed += 1;
        const missing = this.missing();
        setTimeout(() => this.send({ history: missing, points: POINTS }), PAST_AFTER);
        void this.learnEvents();
      },
      now: seconds,
      after: (wait, call) => {
        const timer = setTimeout(call, wait * 1000);
        return () => clearTimeout(timer);
      },
    });
  }

  private admitted(socket: Socket): Socket {
    if (this.problem?.status === 401) this.problem = null;
    return socket;
  }

  /** A token that was revoked leads to the sign-in. */
  private notAdmitted(error: unknown): never {
    const problem = asProblem(error);
    if (problem.status === 401) this.problem = problem;
    throw problem;
  }

  /** s of the past that this page does not have. */
  private missing(): number {
    const newest = this.recording?.newest ?? null;
    const age = newest === null ? null : this.clock.age(newest, seconds());
    return age === null ? AT_START : Math.min(KEPT, age + 1);
  }

  private hear(frame: LiveFrame, at: number): void {
    if (this.clock.wentBack(frame.now, CLOCK_SLACK)) this.beginAnew();
    this.clock.heard(frame.now, frame.utc, at);
    for (const message of frame.messages) {
      this.take(message);
      for (const listener of this.listeners) listener(message);
    }
  }

  /** The service's computer was started anew: what was recorded belongs to another time. */
  private beginAnew(): void {
    if (this.recording !== null) this.recording = new Recording(this.recording.joints, PERIOD, KEPT);
    this.newest = null;
  }

  private take(message: LiveMessage): void {
    switch (message.topic) {
      case 'sample':
        this.takeSample(message);
        break;
      case 'history':
        this.recording?.addHistory(message);
        break;
      case 'record_event':
        this.recording?.addEvent(message);
        break;
      case 'robot':
        this.markStop(message);
        if (isResetOver(this.toldRobot, message)) stop.isReset = false;
        this.toldRobot = message;
        this.tellStop();
        break;
      case 'link':
        this.link = this.health.heard(message, seconds(), this.newest, this.robot?.identity?.period ?? null);
        break;
      case 'queue':
        this.toldQueue = message.status;
        if (!message.status.paused) stop.isReset = false;
        if (message.status.running === null) this.progress = null;
        break;
      case 'progress':
        this.progress = message;
        break;
      case 'job':
        this.jobs = new Map([...this.jobs, [message.job.id, message.job]]);
        break;
      case 'event':
        this.events = [message.event, ...this.events].slice(0, EVENTS_KEPT);
        break;
      case 'teaching':
        this.lines = [...this.lines, message.text].slice(-LINES_KEPT);
        break;
      case 'refused':
        this.refused = message.detail;
        break;
      case 'thinned':
        this.received.thinned(seconds());
        break;
    }
  }

  private takeSample(sample: SampleMessage): void {
    const isFirst = this.newest === null;
    this.newest = sample;
    this.recording?.addSample(sample);
    this.lateness.push(sample.lateness);
    this.received.heard(sample.host_time);
    if (isFirst) queueMicrotask(() => this.tick()); // the newest of those that were kept meanwhile
  }

  /** A stop or fault is an event of the record while an experiment runs; at all other times it is marked here. */
  /** Whether the banner says why a run ended with this reason. */
  isInBanner(reason: string): boolean {
    return this.bannerCause !== '' && reason.includes(this.bannerCause);
  }

  private markStop({ arm, cause }: RobotMessage): void {
    const at = this.clock.at(seconds());
    if (at === null || this.toldRobot === null || this.toldRobot.activity === 'experiment') return;
    if (arm === this.toldRobot.arm || (arm !== 'stopped' && arm !== 'fault')) return;
    const [kind, message] =
      arm === 'fault' ? ([arm, cause] as const) : (['stop', 'the arm was stopped'] as const);
    const where = { tick: this.newest?.tick ?? null, joint: null, experiment: null, host_time: at, time: at };
    this.recording?.addEvent({ topic: 'record_event', kind, message, ...where });
  }

  private tellStop(): void {
    const at = seconds();
    const silence = this.clock.silence(at);
    // With several arms, whoever looks at all of them follows the stop of another one, or of all.
    if (isFleet() && stop.target !== here().robot) return;
    // Without samples the service says nothing until the socket asks it: only an answer that is missing is a silence.
    const isSilent = this.robot?.connection === 'connected' && (silence === null || silence >= SILENT_AFTER);
    stop.heard(armNow(this.isOpen && !isSilent, this.robot), at);
  }

  private tick(): void {
    this.now = seconds();
    this.silence = this.clock.silence(this.now);
    const there = this.clock.at(this.now);
    this.rate = there === null ? null : this.received.rate(there);
    this.isThinned = this.received.isThinned(this.now);
    this.tellStop();
    if (this.newest !== this.sample) this.sample = this.newest;
    this.sampleAge = this.newest === null ? null : this.clock.age(this.newest.host_time, this.now);
    if (this.lateness.length >= 50) {
      this.jitter = Math.max(...this.lateness);
      this.lateness = [];
    }
  }
}

export const live = new Live();
