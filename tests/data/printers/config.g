; A linear delta of RepRapFirmware; written for these tests.
M550 P"delta"                              ; its name
G90
M569 P0 S1
M665 R120.5 L250 B90 H260 X0 Y0 Z0         ; before calibration
M666 X0 Y0 Z0
M92 X80 Y80 Z80 E420
M501                                       ; what M500 has saved
