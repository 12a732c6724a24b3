/**
 * A linear delta of Marlin; written for these tests.
 */
#pragma once
//#define SCARA
#define DELTA
#if ENABLED(DELTA)
  #define DEFAULT_SEGMENTS_PER_SECOND 200
  //#define DELTA_AUTO_CALIBRATION
  #define DELTA_PRINTABLE_RADIUS 115.0   // (mm)
  #define ROD_NOMINAL 268.0
  #define DELTA_DIAGONAL_ROD (ROD_NOMINAL + 0.5f)
  #define DELTA_HEIGHT 301.25            // (mm) Get this value from G33 auto calibrate
  #define DELTA_ENDSTOP_ADJ { -0.25, 0.0, -1.125 }
  #define DELTA_RADIUS 131.75
  #define DELTA_TOWER_ANGLE_TRIM { 0.375, -0.25, 0.0 }
  #define DELTA_RADIUS_TRIM_TOWER { 0.5, 0.0, -0.25 }
  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { 0.25, -0.375, 0.125 }
#endif
#define FIX_MOUNTED_PROBE
#define NOZZLE_TO_PROBE_OFFSET { 0, -20, -1.5 }
