; config-override.g file generated in response to M500
; Delta parameters
M665 L250.125:250.375:249.875 R121.062 H259.437 B90.0 X0.312 Y-0.125 Z0.000
M666 X-0.437 Y0.562 Z-0.125 A0.00 B0.00
