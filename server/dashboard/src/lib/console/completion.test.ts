import { describe, expect, it } from 'vitest';
import type { ConsoleCommand } from '../api/types';
import { completion, givenIn, helpOf } from './completion';
import { macroAsked, macroCommands } from './macro_lines';

const option = (name: string, choices: string[] = [], takes_value = true) => ({
  name,
  flags: [`--${name}`],
  takes_value,
  help: `About ${name}.`,
  default: name === 'joints' ? '1-3' : '',
  choices,
});
const COMMANDS: ConsoleCommand[] = [
  {
    words: ['run', 'ramp'],
    help: 'Equal increments.',
    options: [option('amplitude'), option('joints', ['1-3', '1', '2']), option('dry-run', [], false)],
  },
  {
    words: ['run', 'preset'],
    help: 'Run an experiment by name.',
    options: [{ ...option('name', ['ramp', 'held-out']), flags: [] }, option('dry-run', [], false)],
  },
  { words: ['stop'], help: 'Freeze every robot.', options: [] },
];
const offered = (line: string): string[] => completion(line, COMMANDS).offers.map((one) => one.text);

describe('completion', () => {
  it('offers commands, then their options, then usual values', () => {
    expect(offered('')).toEqual(['run', 'stop', 'help']);
    expect(offered('r')).toEqual(['run']);
    expect(offered('daq run ')).toEqual(['ramp', 'preset']);
    expect(offered('run ramp ')).toEqual(['--amplitude', '--joints', '--dry-run']);
    expect(offered('run ramp --joints ')).toEqual(['1-3', '1', '2']);
    expect(offered('run ramp --joints 1 --')).toEqual(['--amplitude', '--dry-run']);
    expect(offered('run preset h')).toEqual(['held-out']);
    expect(offered('run preset held-out ')).toEqual(['--dry-run']);
    expect(offered('help run r')).toEqual(['ramp']);
    expect(offered('nothing ')).toEqual([]);
  });

  it('replaces the word that is begun and no other', () => {
    expect(completion('run ramp --jo', COMMANDS).from).toBe(9);
    expect(completion('run ramp ', COMMANDS).from).toBe(9);
  });
});

describe('help', () => {
  it('lists the commands below the words, or the options of one command', () => {
    expect(helpOf([], COMMANDS)).toHaveLength(3);
    expect(helpOf(['run'], COMMANDS)).toEqual([
      'run ramp    Equal increments.',
      'run preset  Run an experiment by name.',
    ]);
    expect(helpOf(['run', 'ramp'], COMMANDS)[2]).toBe('--joints     About joints. Without it: 1-3.');
  });
});

describe('the values in a line', () => {
  it('are those of options, also below zero, and not those that are parameters already', () => {
    const line = 'run ramp --joints 2 --amplitude -5.5 --hold {hold} --dry-run --name "a b"';
    expect(givenIn(line).map((one) => [one.name, one.value])).toEqual([
      ['joints', '2'],
      ['amplitude', '-5.5'],
    ]);
    expect(line.slice(givenIn(line)[1]!.at)).toMatch(/^-5\.5/);
  });
});

describe('a kept macro', () => {
  const parameter = {
    name: 'how_far',
    type: 'number' as const,
    default: 5,
    title: '',
    unit: '°',
    choices: [],
  };
  const macro = {
    name: 'two-steps',
    description: '',
    parameters: [parameter],
    lines: ['run step', 'run step'],
  };
  const commands = [...COMMANDS, ...macroCommands([macro as never])];

  it('is a command with its parameters as options', () => {
    const texts = (line: string): string[] => completion(line, commands).offers.map((one) => one.text);
    expect(texts('macro run ')).toEqual(['two-steps']);
    expect(texts('macro run two-steps ')).toEqual(['--how-far', '--dry-run']);
    expect(macroAsked('macro run two-steps --how-far=7 --dry-run'.split(' '), commands)).toEqual({
      name: 'two-steps',
      values: { how_far: '7' },
      isDry: true,
    });
  });

  it('says in one line what is wrong', () => {
    const wrong =
      (line: string, known = commands) =>
      () =>
        macroAsked(line.split(' '), known);
    expect(wrong('macro run')).toThrow('one of two-steps');
    expect(wrong('macro ls', COMMANDS)).toThrow('no macro is kept');
    expect(wrong('macro run two-steps --fast 3')).toThrow('has no --fast');
    expect(wrong('macro run two-steps --how-far')).toThrow('needs a value');
  });
});
