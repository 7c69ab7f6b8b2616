/** `macro run NAME --parameter value`: the kept macros as commands of the console. A terminal has none. Pure. */

import type { ConsoleCommand, Macro } from '../api/types';
import { commandOf } from './completion';

/** A macro with the values that a line gives; the others are its defaults. */
export interface AskedMacro {
  readonly name: string;
  readonly values: Record<string, string | number>;
  readonly isDry: boolean;
}

const DRY = {
  name: 'dry_run',
  flags: ['--dry-run'],
  takes_value: false,
  help: 'Show the motions; nothing is sent.',
  default: '',
  choices: [],
};

/** A command for each macro; its parameters are the options. */
export function macroCommands(macros: readonly Macro[]): ConsoleCommand[] {
  return macros.map(({ name, description, parameters, lines }) => ({
    words: ['macro', 'run', name],
    help:
      description ||
      `Add ${lines.length === 1 ? 'its experiment' : `its ${lines.length} experiments`} to the queue.`,
    options: [
      ...(parameters ?? []).map((one) => ({
        name: one.name,
        flags: [`--${one.name.replaceAll('_', '-')}`],
        takes_value: true,
        help: `${one.title || one.name.replaceAll('_', ' ')}${one.unit ? ` (${one.unit})` : ''}.`,
        default: String(one.default),
        choices: [...(one.choices ?? [])],
      })),
      DRY,
    ],
  }));
}

/** What the words of a line ask for. Throws an Error of one line. */
export function macroAsked(words: readonly string[], commands: readonly ConsoleCommand[]): AskedMacro {
  const command = commandOf(words, commands);
  if (command === undefined) {
    const names = commands.flatMap((one) => (one.words[0] === 'macro' ? [one.words[2]!] : []));
    throw new Error(
      names.length === 0
        ? 'no macro is kept; the tab Macros makes one'
        : `macro: write “macro run” and one of ${names.join(', ')}`,
    );
  }
  const values: Record<string, string | number> = {};
  let isDry = false;
  const rest = words
    .slice(command.words.length)
    .flatMap((word) => (/^--[a-z].*=/.test(word) ? halves(word) : [word]));
  for (let place = 0; place < rest.length; place++) {
    const option = command.options.find((one) => one.flags.includes(rest[place]!));
    if (option === undefined) throw new Error(`${command.words.join(' ')}: has no ${rest[place]}`);
    if (!option.takes_value) {
      isDry = true;
      continue;
    }
    const text = rest[++place];
    if (text === undefined) throw new Error(`${command.words.join(' ')}: ${option.flags[0]} needs a value`);
    values[option.name] = text;
  }
  return { name: command.words[2]!, values, isDry };
}

function halves(word: string): string[] {
  const at = word.indexOf('=');
  return [word.slice(0, at), word.slice(at + 1)];
}
