"""Elements and attributes of MuJoCo models that are known: those that are read, and those that move nothing."""

from __future__ import annotations

from .known_elements import Table
from .mjcf_plain import ACTUATORS, ALL_ACTUATORS, KEPT

CONTACT = "@group @user @solref @solimp @margin @gap @material @rgba"
EVERY = (*ALL_ACTUATORS, "plugin")
BONDS = ("connect", "weld", "joint", "tendon", "flex", "flexstrain", "flexvert", "distance")

# of an actuator: what it drives, how control becomes force, and settings of the simulation
DRIVE = (
    "@joint @jointinparent @tendon @body @site @refsite @cranksite @slidersite @cranklength @lengthrange @user @group"
    " @ctrlrange @ctrllimited @forcerange @forcelimited @actrange @actlimited @gear @dyntype @gaintype @biastype"
    " @dynprm @gainprm @biasprm @actdim @actearly @kp @kv @ki @imax @dampratio @timeconst @inheritrange @area @diameter"
    " @bias @force @fpmax @fvmax @lmax @lmin @range @scale @tausmooth @vmax @gain @plugin @instance config"
    " @nsample @interp @delay @input @ffrange @velrange @posrange @slewmax @class @cogging @controller @inductance"
    " @lugre @motorconst @nominal @resistance @saturation @thermal"
)


def _kept(kind: str, *more: str) -> str:
    """The words of what is read of an element, and more."""
    return " ".join([*(f"@{key}" for key in KEPT[kind]), *more])


MJCF: Table = {
    "mujoco": "@model compiler option size statistic visual default extension asset worldbody contact tendon equality"
    " actuator sensor custom keyframe deformable",
    "compiler": _kept("compiler", "@settotalmass @assetdir @meshdir @texturedir @strippath @discardvisual @fitaabb")
    + " @fusestatic @saveinertial @savecompiled @savecanonical @passthrough @usethread @conflict lengthrange"
    " @coordinate!local @alignfree!false @convexhull @exactmeshinertia",
    "option": "@timestep @apirate @impratio @tolerance @ls_tolerance @noslip_tolerance @mpr_tolerance @ccd_tolerance"
    " @sleep_tolerance @gravity~0_0_-9.81 @wind @magnetic @density @viscosity @o_margin @o_solref @o_solimp @o_friction"
    " @integrator @cone @jacobian @solver @iterations @ls_iterations @noslip_iterations @mpr_iterations @ccd_iterations"
    " @sdf_iterations @sdf_initpoints @actuatorgroupdisable~ @collision flag",
    "flag": "@equality~enable @constraint~enable @limit~enable @actuation~enable @frictionloss~enable @clampctrl~enable"
    " @damper~enable @spring @passive @gravity~enable @contact @energy @fwdinv @invdiscrete @override @warmstart"
    " @filterparent @refsafe @sensor @midphase @nativeccd @eulerdamp @autoreset @multiccd @island @sensornoise"
    " @diagexact @ipc @sleep @speculative",
    "default": "@class default mesh material texture joint geom site camera light pair equality tendon "
    + " ".join(EVERY),
    "worldbody": "@childclass body frame replicate inertial geom site camera light plugin composite flexcomp attach",
    "body": _kept("body", "@gravcomp~0 @mocap~false @user @sleep @simple @fuse body frame replicate joint freejoint")
    + " inertial geom site camera light plugin composite flexcomp attach",
    "frame": _kept("frame", "body frame replicate joint freejoint inertial geom site camera light plugin composite")
    + " flexcomp attach",
    "replicate": _kept("replicate", "@prefix body frame replicate geom site camera light composite flexcomp attach"),
    "joint": _kept("joint", "@group @user @margin @solreflimit @solimplimit @solreffriction @solimpfriction @stiffness")
    + " @springref @springyield @springdamper~0_0 @actuatorgravcomp~false",
    "freejoint": _kept("freejoint", "@group @align!false|auto"),
    "inertial": _kept("inertial"),
    "geom": _kept("geom", CONTACT, "@condim @priority @friction @solmix @hfield @mesh @fitscale @fluidshape @fluidcoef")
    + " @castshadow @adhesion @surfacevel plugin",
    "site": _kept("site", "@group @user @material @rgba @mesh"),
    "equality": " ".join(BONDS),
    "default/equality": _kept("equality", "@solref @solimp"),
    **{f"equality/{kind}": _kept(kind, "@solref @solimp") for kind in ("connect", "weld")},
    "equality/joint": _kept("joint of equality", "@solref @solimp"),
    "equality/tendon": None,
    "default/tendon": None,
    "tendon": None,
    **{f"default/{kind}": f"{DRIVE} @armature @damping" for kind in ACTUATORS},
    **{f"default/{kind}": f"{DRIVE} @armature!0 @damping!0" for kind in EVERY if kind not in ACTUATORS},
    "actuator": " ".join(EVERY),
    **{f"actuator/{kind}": f"{DRIVE} @armature @damping" for kind in EVERY},
    "keyframe": "key",
    "key": _kept("key", "@time @qvel @act @ctrl @mpos~ @mquat~ @plastic"),
    "config": None,
}
"""A <mujoco> model, versions 2.1 to 4.0; sections without an entry look, sense, touch, or are read elsewhere.

A bond of tendons, a composite body and an attached model are refused by what reads them; springs and tendons are noted.
"""
