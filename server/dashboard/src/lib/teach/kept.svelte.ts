/**
 * Taught programs as the service keeps them: every change of the one that is open is sent at once, one after the other,
 * so that neither the end of the control nor a change of page loses anything. What asks the service is handed in.
 */

import { asProblem, type Problem } from '../api/problem';
import type { ProgramEntry } from '../api/types';
import { programOf, type Instruction, type Program } from './program';

export interface ProgramRequests {
  /** The one changed last first. */
  list(): Promise<readonly ProgramEntry[]>;
  load(name: string): Promise<{ entry: ProgramEntry; program: Program }>;
  /** Keeps a new program (`revision` null), or a change of the one that is called `name` now. */
  put(name: string, program: Program, revision: number | null): Promise<ProgramEntry>;
  remove(name: string): Promise<void>;
}

const FIRST_NAME = 'taught';

export class KeptPrograms {
  entries = $state.raw<readonly ProgramEntry[]>([]);
  instructions = $state.raw<readonly Instruction[]>([]);
  /** As it is to be called; another name than `open`'s renames it. */
  name = $state(FIRST_NAME);
  /** The program as the service has it; null for one that it does not have yet. */
  open = $state.raw<ProgramEntry | null>(null);
  /** Whether the service has everything that is shown. */
  isKept = $state(true);
  problem = $state.raw<Problem | null>(null);
  private isSending = false;

  constructor(
    private readonly machine: string,
    private readonly requests: ProgramRequests,
  ) {}

  program(): Program {
    return programOf(this.name, this.machine, this.instructions);
  }

  /** Asks for the list, and opens the one changed last where nothing is being written. */
  async start(): Promise<void> {
    await this.tried(async () => {
      this.entries = await this.requests.list();
      const [newest] = this.entries;
      if (this.open === null && this.instructions.length === 0)
        if (newest === undefined) this.begin();
        else await this.show(newest.name);
    });
  }

  /** An empty program with a name that is free. */
  begin(): void {
    const taken = this.entries.map((one) => one.name);
    let name = FIRST_NAME;
    for (let number = 2; taken.includes(name); number++) name = `${FIRST_NAME}-${number}`;
    this.name = name;
    this.instructions = [];
    this.open = null;
    this.isKept = true;
    this.problem = null;
  }

  async load(name: string): Promise<void> {
    await this.tried(() => this.show(name));
  }

  /** Shows a change, and has the service keep it. */
  async change(instructions: readonly Instruction[]): Promise<void> {
    this.instructions = instructions;
    await this.keep();
  }

  async rename(name: string): Promise<void> {
    this.name = name;
    await this.keep();
  }

  /** Has the service keep what is shown. Called again meanwhile, it sends what is shown then. */
  async keep(): Promise<void> {
    this.isKept = false;
    if (this.isSending || this.instructions.length === 0) return;
    this.isSending = true;
    try {
      await this.tried(() => this.sendUntilKept());
      // Deleted by somebody else: the next try keeps it as a new one.
      if (this.problem?.status === 404) this.open = null;
    } finally {
      this.isSending = false;
    }
  }

  /** Deletes the one that is open, for good. */
  async remove(): Promise<void> {
    const { open } = this;
    if (open === null) {
      this.begin();
      return;
    }
    await this.tried(async () => {
      await this.requests.remove(open.name);
      this.entries = this.entries.filter((one) => one.name !== open.name);
      this.begin();
    });
  }

  private async sendUntilKept(): Promise<void> {
    for (;;) {
      const program = this.program();
      const before = this.open;
      const entry = await this.requests.put(before?.name ?? program.name, program, before?.revision ?? null);
      this.open = entry;
      this.entries = [
        entry,
        ...this.entries.filter((one) => one.name !== entry.name && one.name !== before?.name),
      ];
      this.isKept =
        program.name === this.name &&
        program.instructions.length === this.instructions.length &&
        program.instructions.every((one, place) => one === this.instructions[place]);
      if (this.isKept) return;
    }
  }

  private async show(name: string): Promise<void> {
    const { entry, program } = await this.requests.load(name);
    this.open = entry;
    this.name = program.name;
    this.instructions = program.instructions;
    this.isKept = true;
  }

  private async tried(work: () => Promise<void>): Promise<void> {
    try {
      await work();
      this.problem = null;
    } catch (error) {
      this.problem = asProblem(error);
    }
  }
}
