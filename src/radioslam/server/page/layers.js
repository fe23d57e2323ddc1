// All layers, in the order of the panel and in that of drawing.

import { accessPoints } from "./layer_access_points.js";
import { arriving } from "./layer_arriving.js";
import { gaps } from "./layer_gaps.js";
import { heat } from "./layer_heat.js";
import { loops } from "./layer_loops.js";
import { estimate, odometry, sigma, truth, untied } from "./layer_paths.js";
import { positions } from "./layer_positions.js";

export const LAYERS = [estimate, odometry, truth, sigma, loops, heat, gaps, accessPoints, arriving, positions, untied];
export const LOWEST_FIRST = [heat, odometry, sigma, estimate, truth, untied, loops, arriving, accessPoints, gaps, positions];
