"""The model of a package that uses parts of `my_robot`, the model in tests/python/modelling/guidance.yaml."""

_ARM = """\
mauve_model: 1
package: my_arm
types:
  Reach: REACH
shells:
  ArmShell:
    ports: {reach: {read: Reach}, goal: {write: my_robot/Point2D}}
cores:
  Arm:
    shell: ArmShell
    actions: [move]
    state: {last: my_robot/Point2D}
    implementations: {QuickArm: {wcet: {move: 1 ms}}}
  Follower:
    shell: my_robot/GuidanceShell
    actions: [follow]
    implementations: {Eager: {wcet: {follow: 2 ms}}}
fsms:
  ArmFsm:
    core: Arm
    initial: Move
    states: {Move: {run: move, next: Rest}, Rest: {wait: 20 ms, next: Move}}
  FollowerFsm:
    core: Follower
    initial: Follow
    states: {Follow: {run: follow, next: Rest}, Rest: {wait: 2 * unit_ms, next: Follow}}
  SlowGuidanceFsm:
    core: my_robot/Guidance
    initial: Idle
    states:
      Idle: {run: read_inputs, next: [{if: has_new_goal, to: Planning}, W5]}
      Planning: {run: compute_path, next: W5}
      W5: {wait: 5 * unit_ms, next: Idle}
"""


def arm(reach: str) -> str:
    """Text of the model of `my_arm`, with these fields of its type `Reach`."""
    return _ARM.replace("REACH", reach)
