; A rotary delta of RepRapFirmware; written for these tests.
M669 K10 U110:110.25:109.75 L230 H270:270.125:270.25 R48.5 A-50:40 X0.75 Y-0.5 Z0 S100
M666 X0.25 Y-0.5 Z0
