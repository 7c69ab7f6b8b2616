/** The gallery: every component in its states, without a service. The address names the scene: `gallery.html#stopped`. */

import './no_service';
import '@fontsource-variable/inter/wght.css';
import { mount } from 'svelte';
import '../app.css';
import { theme } from '../lib/theme.svelte';
import Gallery from './Gallery.svelte';
import { begin, SCENES, type Scene } from './scenes';

const wanted = location.hash.slice(1);
const scene: Scene = SCENES.find((one) => one === wanted) ?? 'parts';
const target = document.getElementById('app');
if (target === null) throw new Error('gallery.html has no element with the id "app"');
theme.start();
begin(scene);
mount(Gallery, { target, props: { scene } });
