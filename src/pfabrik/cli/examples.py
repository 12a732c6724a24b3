"""Examples of every command, which its help ends with."""

from __future__ import annotations

EXAMPLES = {
    "catalog": ("catalog", "catalog --json"),
    "new": ("new 6-UPS -o my.toml", "new linear-delta --arm-length 300 --delta-radius 120"),
    "info": ("info stewart", "info my.toml --json"),
    "check": ("check my.toml", "check printer.cfg"),
    "ik": ("ik stewart --position 10 0 190 --rpy 0 5 0", "ik my.toml --position 0 0 300 --margins"),
    "fk": ("fk five_bar -20 20", "fk five_bar -20 20 --all"),
    "track": ("track stewart path.csv -o answers.csv", "track linear_delta part.gcode --plot part.png"),
    "travel": ("travel stewart --position 0 20 200", "travel stewart --about 0 0 1 --plot travel.png"),
    "workspace": ("workspace stewart --fix z=190", "workspace five_bar -o workspace.png"),
    "certify": ("certify stewart --box -10:10,-10:10,185:195", "certify delta --ball 0,0,-200,20 --tolerance 0.05"),
    "design": (
        "design my.toml --vary longest=200:600 --ball 0,0,195,20 --minimise longest -o designed.toml",
        "design my.toml --vary base_radius=60:200 --vary height=100:400 --box -9:9,-9:9,-9:9 --about home --margin 0.1",
    ),
    "calibrate": ("calibrate printer.cfg", "calibrate printer.cfg --klipper calibrated.cfg"),
    "time": (
        "time linear_delta part.gcode --speed 300 -o timed.csv",
        "time linear_delta part.gcode --torque 20 --load platform=0.5,0,0,0",
    ),
    "effort": (
        "effort linear_delta part.gcode --load platform=0.5,0,0,0",
        "effort linear_delta part.gcode --torque 20 --load platform=0.5,0,0,0 -o efforts.csv --plot efforts.png",
    ),
    "identify": (
        "identify delta.toml measured.csv --body platform",
        "identify delta.toml measured.csv --columns t=time,effort_A1=tau1 -o identified.toml",
    ),
    "speed": ("speed five_bar --position 0 10 180 --speed 30", "speed stewart --speed 50 --speed BL1=20"),
    "singularities": ("singularities five_bar --position 0 30 200", "singularities five_bar --over y,z -o map.png"),
    "forces": (
        "forces stewart --position 10 0 190 --force 0 0 -200",
        "forces stewart --load platform=5,0,0,195 --reactions",
    ),
    "stiffness": ("stiffness stewart --k 500", "stiffness delta --position 10 0 -200 --k 2000 --rod 5000"),
    "accuracy": ("accuracy stewart --error 0.01", "accuracy delta --error 0.05 --error BL1=0.02 --rms"),
    "transmission": ("transmission delta", "transmission stewart --position 10 0 190 --json"),
    "clearance": ("clearance reachy_mini", "clearance reachy_mini --rpy 0 20 0"),
    "plot": ("plot stewart --position 10 0 190", "plot g1_ankle --torque-map -o torques.png"),
    "view": ("view stewart", "view five_bar --html five_bar.html"),
    "import": (
        "import robot.xml --end-effector platform -o mine.toml",
        "import robot.xml --end-effector platform --unit mm --json",
    ),
    "join": (
        "join panda panda --at 0,300,0 --at 0,-300,0 --prefix left_ --prefix right_ --hold box -o two.toml",
        "join linear_delta stewart --prefix a_ --prefix b_ --on platform --end-effector b_platform -o hybrid.toml",
    ),
    "export": ("export stewart c -o stewart.c", "export g1_ankle --numpy ankle.py --joints pitch_joint,roll_joint"),
    "verify": ("verify stewart", "verify mine.toml --original robot.xml"),
    "demo": ("demo --quick", "demo --steps 90 -o pictures"),
}
"""Command -> two command lines, without the name of the program; one test runs them all."""
