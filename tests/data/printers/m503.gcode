echo:  G21    ; Units in mm (mm)
echo:; Endstop adjustment:
echo:  M666 X-0.25 Y0.00 Z-1.13
echo:; Delta settings:
echo:  M665 L268.50 R131.75 H301.25 S200.00 X0.38 Y-0.25 Z0.00 A0.25 B-0.38 C0.13
