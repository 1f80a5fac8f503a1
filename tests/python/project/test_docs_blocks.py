"""Each block of commands or code in README.md and docs/ is run by a test, or its marker says why not.

The table names the tests: they read the block from its page and try it, or run its commands with names of
their own. The pages in docs/tutorials/ are in no table: one test runs all their blocks.
"""

from collections.abc import Collection
from pathlib import Path

import pytest
from page_blocks import Block, blocks
from pages import PAGES
from proofs import is_there
from tutorial_pages import is_run

ROOT = Path(__file__).resolve().parents[3]
README = "python/project/test_readme_examples.py::test_"
TUTORIALS = "docs/tutorials/"
TUTORIALS_RUN_BY = "ros/test_tutorials.py::test_the_page_does_what_it_says"
HOWTO_ANALYZE = "python/cli/test_analyze_pages.py::test_the_commands_of_the_how_to_print_what_it_shows"
DRAWN = "python/cli/test_graph.py::test_the_commands_of_the_how_to_draw"
HOWTO = "python/project/test_howto_pages.py::test_"
OVERRUN = f"{HOWTO}the_commands_that_find_an_overrun_print_what_it_shows"
HOWTO_ROS = "ros/executor/test_howto_pages.py::test_"
REPAIRED = f"{HOWTO_ROS}a_faulted_component_is_repaired_as_the_page_says"
ADDED = f"{HOWTO_ROS}a_component_is_removed_and_added_as_the_page_says"
GIVEN_UP = f"{HOWTO_ROS}a_hung_component_is_given_up_as_the_page_says"
PART_LOG = "ros/executor/test_part_log.py::test_"
PEERS = f"{HOWTO_ROS}a_node_of_rclpy_and_its_component_do_the_same"
SERVED = f"{HOWTO_ROS}the_action_of_the_page_is_served"
UNIT_FILES = f"{HOWTO}systemd_knows_each_line_of_the_units"
SNAPSHOT = "python/trace/test_snapshot.py::test_every_reader_reads_a_snapshot_of_a_bag_that_is_being_written"
WAKEUP = f"{HOWTO}the_wakeup_latency_is_measured_and_used_as_the_page_says"
PINNED = f"{HOWTO}the_settings_of_pinned_components_are_accepted"

# Of each page: words that stand in one of its blocks only, and the tests that run that block.
RUN_BY: dict[str, dict[str, tuple[str, ...]]] = {
    "README.md": {
        "scripts/demo          # sets everything up": (
            "system/test_demo_mission.py::test_it_succeeds_and_says_so",
            "python/project/test_readme_scripts.py::test_every_folder_of_tests_is_a_stage",
        ),
        "import time": (f"{README}the_smallest_component_is_replaced_live",),
    },
    "docs/concepts/resources.md": {
        "scan:  {kind: shared_data": (f"{README}the_pieces_of_architecture_files_are_accepted",),
        "lamp:  {kind: client": (f"{README}the_pieces_of_architecture_files_are_accepted",),
    },
    "docs/concepts/timing_proof.md": {
        "control: {..., deadline_ns:": (f"{README}the_pieces_of_architecture_files_are_accepted",),
        "control: {..., enforce_wcet:": (f"{README}the_pieces_of_architecture_files_are_accepted",),
    },
    "docs/howto/ci_for_your_package.md": {
        "def test_ten_beats_in_a_second": (f"{HOWTO}the_test_in_virtual_time_passes",),
        "mauve check install/share/mauve_examples": (f"{HOWTO}the_checks_of_ci_end_with_status_0",),
        "runs-on: ubuntu-24.04": (f"{HOWTO}the_jobs_of_ci_have_one_set_of_commands",),
        "image: ros:jazzy": (f"{HOWTO}the_jobs_of_ci_have_one_set_of_commands",),
    },
    "docs/howto/coming_from.md": {
        "class Doubler(Node)": (PEERS,),
        "class Doubler(Core)": (PEERS,),
        "core; my_robot/Doubler;": (PEERS,),
        "doubler: {shell: mauve_rt/Float64FilterShell": (PEERS,),
    },
    "docs/howto/develop_live.md": {
        "--watch src/my_robot": ("ros/cli/test_dev.py::test_the_commands_of_the_page",),
        "--once": ("ros/cli/test_dev.py::test_the_commands_of_the_page",),
    },
    "docs/howto/draw_an_architecture.md": {
        "--out robot.svg": (DRAWN,),
        "--out rules.svg": (DRAWN,),
        "--out guidance.svg": (DRAWN,),
    },
    "docs/howto/find_an_overrun.md": {
        "--suppose guidance.Planning=120ms --witness preempted": (OVERRUN,),
        "--suppose mapping.Integrate=120ms --witness too_long": (OVERRUN,),
        "mauve report preempted": (OVERRUN,),
        "No: 1 missed deadline": (OVERRUN,),
        "mauve report too_long": (OVERRUN,),
        "its state Integrate took longest": (OVERRUN,),
        "mauve trace stats preempted": (OVERRUN,),
        "component  what             count": (OVERRUN,),
    },
    "docs/howto/is_my_robot_schedulable.md": {
        "mauve analyze robot.yaml --witness DIR": (
            "python/cli/test_analyze.py::test_what_is_not_says_who_misses_when_and_why_and_shows_it",
            "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
        ),
        "cpus: [1]": ("python/cli/test_analyze_pages.py::test_the_pieces_of_files_are_accepted",),
        "deadline_ns: 5000000": ("python/cli/test_analyze_pages.py::test_the_pieces_of_files_are_accepted",),
        "--budget-from BAG": ("ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",),
        "overhead_ns: 20000}": ("python/cli/test_analyze_pages.py::test_the_pieces_of_files_are_accepted",),
        "require_schedulable": ("python/cli/test_analyze_pages.py::test_the_pieces_of_files_are_accepted",),
        "architecture/robot.yaml\n": (HOWTO_ANALYZE,),
        "schedulable: every component": (HOWTO_ANALYZE,),
        "--suppose guidance.Planning=120ms --witness slow": (HOWTO_ANALYZE,),
        "not schedulable: mapping": (HOWTO_ANALYZE,),
        "mauve report slow": (HOWTO_ANALYZE,),
        "--chain scan:control:command": (HOWTO_ANALYZE,),
        "scan:control:command: reaction at most": (HOWTO_ANALYZE,),
    },
    "docs/howto/launch_files.md": {
        "def generate_launch_description": (f"{HOWTO}the_launch_file_of_the_page_gives_arguments_there_are",),
    },
    "docs/howto/look_up_frames.md": {
        "mauve check wrong.yaml": (f"{HOWTO}a_pose_in_another_frame_is_refused_as_the_page_says",),
        "component 'control'": (f"{HOWTO}a_pose_in_another_frame_is_refused_as_the_page_says",),
    },
    "docs/howto/operate.md": {
        "mauve list /robot_1/executor": (
            f"{README}every_command_is_one_that_mauve_takes",
            "ros/cli/test_verbs.py::test_verbs_do_what_they_say",
            "ros/cli/test_verbs.py::test_events_are_followed",
        ),
        "cat > steps.yaml <<END": (
            f"{README}the_steps_fit_the_mission",
            "ros/cli/test_verbs.py::test_a_transaction_is_carried_out_and_reported_step_by_step",
        ),
        "mauve replace-core /robot_1/executor guidance": (
            "ros/executor/test_faulted_component.py::test_by_the_command_line",
        ),
        "ros2 service call /robot_1/executor/replace_core": (
            f"{README}service_calls_have_fields_of_their_services",
            "ros/executor/test_services.py::test_replace_core_in_flight_takes_over_the_count",
        ),
        "ros2 launch mauve_rt executor.launch.py": (
            f"{README}launch_arguments_are_declared",
            "ros/test_launch.py::test_an_executor_with_its_supervisor",
            "ros/test_launch.py::test_the_mission_loses_its_link_and_gets_it_back",
        ),
        "ros2 param set": (
            "ros/executor/test_parameters.py::test_parameters_are_the_properties",
            "python/node/test_arguments.py::test_parameters_of_one_file_for_several_robots",
        ),
        "executor: {diagnostics:": (f"{README}the_pieces_of_architecture_files_are_accepted",),
        "mauve changes /robot_1/executor": (
            f"{README}every_command_is_one_that_mauve_takes",
            "ros/executor/test_open_changes.py::test_a_late_component_is_listed_abandoned_and_removed",
        ),
        "printf 'force: true": ("ros/executor/test_force.py::test_a_hung_component_is_removed_by_force",),
    },
    "docs/howto/pin_and_isolate_cpus.md": {
        "priority: 70, cpus: [2]": (PINNED,),
        "asks for a CPU": (f"{HOWTO}a_cpu_that_is_not_there_is_refused_as_the_page_says",),
        "mauve trace stats docs/sample/metronome": (WAKEUP,),
        "metronome  wake-up latency": (WAKEUP,),
        "--wakeup-us 300": (WAKEUP,),
        "each release begins up to 0.300 ms": (WAKEUP,),
        "wakeup_max_us: {warn: 300": (PINNED,),
    },
    "docs/howto/record_and_report.md": {
        "mauve record start /executor all": (
            "ros/executor/test_recording.py::test_topics_by_pattern_are_recorded_also_those_that_appear_later",
        ),
        "mauve record start /executor images": (
            "ros/bridge/test_topic_receiver.py::test_messages_of_4_mb_are_received_or_counted",
        ),
        "mauve record start /executor --snapshot": (
            f"{README}every_command_is_one_that_mauve_takes",
            "ros/cli/test_verbs.py::test_a_snapshot_by_the_command",
        ),
        "mauve record start /executor before_lunch": (
            f"{README}every_command_is_one_that_mauve_takes",
            f"{README}service_calls_have_fields_of_their_services",
            "ros/executor/test_recording.py::test_a_bag_begun_and_ended_while_the_executor_runs",
        ),
        "mauve trace info DIR": (
            "python/cli/test_trace.py::test_info",
            "python/cli/test_trace.py::test_check_and_repair",
            SNAPSHOT,
            "python/cli/test_trace.py::test_stats",
            "python/cli/test_trace_export.py::test_perfetto_is_the_default",
        ),
        "all_statistics(trace)": (f"{README}the_python_example_reads_a_bag",),
        "import matplotlib": (f"{README}the_python_example_plots_a_value",),
        "# writes DIR/report.html": (
            "python/trace/report/test_page.py::test_the_command_writes_into_the_bag_unless_told_otherwise",
        ),
        "mauve report A B --compare": (
            "python/trace/report/test_compare.py::test_the_page_is_in_the_first_folder_unless_told_otherwise",
        ),
    },
    "docs/howto/repair_a_faulted_component.md": {
        "# before the repair": (REPAIRED,),
        "refused, FAULTED (6)": (REPAIRED,),
        "printf -- '- {kind: configure": (REPAIRED,),
        "2 steps are in force": (REPAIRED,),
        "mauve replace-core /robot_1/executor guidance": (REPAIRED,),
        "kind: remove_component": (ADDED,),
        "anew.yaml --dry-run": (ADDED,),
        "guidance --force": (GIVEN_UP,),
        "is stopped by force": (GIVEN_UP,),
    },
    "docs/howto/log_lines.md": {
        "[WARN] [1796050000.250104]": (f"{PART_LOG}a_line_is_on_rosout_the_console_and_in_the_bag",),
        "guidance: {..., log_level:": (f"{README}the_pieces_of_architecture_files_are_accepted",),
        "mauve log-level /robot_1/executor guidance debug": (
            f"{PART_LOG}levels_are_set_by_mauve_and_by_the_services_of_ros",
        ),
        "ros2 service call /robot_1/executor/set_logger_levels": (
            f"{PART_LOG}levels_are_set_by_mauve_and_by_the_services_of_ros",
        ),
    },
    "docs/howto/see_values.md": {
        "mauve echo /robot_1/executor pose   ": (
            "ros/executor/test_values.py::test_echo",
            "ros/executor/test_values.py::test_echo_as_a_table",
        ),
        "mauve get /robot_1/executor control.max_speed": (
            "ros/executor/test_values.py::test_get_prints_a_property_or_a_field",
        ),
        "mauve mirror /robot_1/executor pose   ": (
            "ros/executor/test_values.py::test_the_command_starts_and_stops_a_mirror",
        ),
        "mauve record start /robot_1/executor --value": (
            "ros/executor/test_values.py::test_every_write_is_recorded",
        ),
        "executor: {record:": (
            "ros/executor/test_values.py::test_every_write_is_recorded",
            "ros/executor/test_values.py::test_every_write_is_recorded_in_virtual_time",
        ),
        "executor: {mirror:": ("ros/executor/test_values.py::test_mirrors_of_the_file",),
        "mauve watch /robot_1/executor --once": (
            "ros/cli/test_watch.py::test_a_table_that_keys_change",
            "ros/cli/test_watch.py::test_once_it_needs_no_terminal",
        ),
    },
    "docs/howto/serve_an_action.md": {
        "executor: {namespace: /robot_1}": (SERVED,),
        "class DriverShell(Shell)": (SERVED,),
        "shell; my_robot/DriverShell": (SERVED,),
        'print("reached:"': (SERVED,),
        "mauve replace-core": (SERVED,),
    },
    "docs/howto/systemd.md": {
        "Description=MAUVE RT executor": (
            UNIT_FILES,
            f"{HOWTO_ROS}the_command_of_the_unit_file_starts_an_executor",
        ),
        "systemd-analyze verify": (UNIT_FILES,),
        "Description=MAUVE RT supervisor": (UNIT_FILES,),
    },
    "docs/howto/compare_in_shadow.md": {
        "control --promote": ("ros/executor/test_reload.py::test_the_commands_of_the_shadow_page",),
    },
    "docs/howto/reload_code.md": {
        "mauve reload /robot_1/executor --back": (
            "ros/executor/test_reload.py::test_the_commands_of_the_page",
        ),
        "MAUVE_STATE(integral_": ("python/control/test_reload.py::test_the_state_fields_of_the_page",),
        "state_fields = {": ("python/control/test_reload.py::test_the_state_fields_of_the_page",),
    },
    "docs/howto/try_on_probation.md": {
        "--probation-releases 100": ("ros/executor/test_reload.py::test_the_commands_of_the_probation_page",),
        "- kind: replace_core": ("ros/executor/test_reload.py::test_the_commands_of_the_probation_page",),
    },
    "docs/howto/uninstall.md": {
        "rm -rf .venv build install": (f"{HOWTO}uninstalling_leaves_nothing_but_the_sources",),
        "# bags and reports of scripts/demo": (f"{HOWTO}uninstalling_leaves_nothing_but_the_sources",),
    },
    "docs/howto/write_a_core.md": {
        "struct MetronomeShell": (f"{README}listings_stand_in_the_sources",),
        "class Metronome(mauve_rt.api.Core)": (f"{README}listings_stand_in_the_sources",),
        "architecture/metronome.yaml": (
            "python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",
        ),
        "rover.yaml &": (
            "python/model/test_python_parts.py::test_the_rover_of_the_examples_takes_another_core",
        ),
        "open_architecture(": (
            "python/model/test_python_parts.py::test_the_rover_of_the_examples_is_tested_as_the_page_says",
        ),
        "find_package(mauve_rt REQUIRED)": (
            "doors/test_colcon.py::test_downstream_core_replaces_a_running_one",
        ),
    },
    "docs/rules.md": {
        "name: link_lost": (
            "python/cli/test_rules_try.py::test_the_story_and_the_timeline_of_the_documentation",
        ),
        "silence: {resource: pose": (
            "python/supervision/test_rules_page.py::test_there_is_an_example_of_each_kind",
        ),
        "one period of exploration": ("python/test_rules_check.py::test_the_bound_of_the_documentation",),
        "lasts_s: 20": (
            "python/cli/test_rules_try.py::test_the_story_and_the_timeline_of_the_documentation",
        ),
        "link_lost: armed": (
            "python/cli/test_rules_try.py::test_the_story_and_the_timeline_of_the_documentation",
        ),
    },
    "docs/several_machines.md": {
        "ROS_DOMAIN_ID=42": ("ros/test_discovery.py::test_only_who_is_told_so_listens_to_the_network",),
        "ROS_STATIC_PEERS='10.0.0.7": (
            "ros/links/test_peers.py::test_peers_that_name_each_other_need_no_multicast",
        ),
        "on this machine only: UDP": (
            "ros/test_discovery.py::test_an_executor_is_bound_to_loopback_however_it_was_told_to_stay",
        ),
        "dds/local.xml": (
            "ros/test_discovery.py::test_an_executor_is_bound_to_loopback_however_it_was_told_to_stay",
        ),
        "dds/local_udp.xml": (
            "ros/cli/test_other_account.py::test_the_installed_profile_is_for_other_programs",
        ),
    },
}


def _entries(block: Block, table: Collection[str]) -> list[str]:
    return [words for words in table if words in block.text]


def _unexplained(text: str, table: Collection[str]) -> list[str]:
    """The blocks that have neither an entry nor a marker, or more than one of these."""
    return [
        f"line {block.lines.start + 1}: {block.first_line}"
        for block in blocks(text)
        if len(_entries(block, table)) + bool(block.not_run) != 1
    ]


OTHERS = [page for page in PAGES if not page.startswith(TUTORIALS)]


@pytest.mark.parametrize("page", OTHERS)
def test_each_block_is_run_or_says_why_not(page: str) -> None:
    assert _unexplained(PAGES[page], RUN_BY.get(page, {})) == [], (
        "name the test that runs it in RUN_BY, or write <!-- not run: REASON --> in the line above"
        " (a directive that is no code begins with :::)"
    )


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith(TUTORIALS)])
def test_each_block_of_a_tutorial_is_a_file_or_commands_or_says_why_not(page: str) -> None:
    text = PAGES[page]
    wrong = [block for block in blocks(text) if is_run(block, text) == bool(block.not_run)]
    assert [f"line {block.lines.start + 1}: {block.first_line}" for block in wrong] == [], (
        "end the paragraph above with `path/of/file`: or make it a console block (tests/tutorial_pages.py),"
        " or write <!-- not run: REASON --> in the line above"
    )
    assert is_there(TUTORIALS_RUN_BY)


@pytest.mark.parametrize(("page", "words"), [(page, words) for page in RUN_BY for words in RUN_BY[page]])
def test_each_entry_has_its_block_and_its_tests(page: str, words: str) -> None:
    found = [block for block in blocks(PAGES[page]) if words in block.text]
    assert len(found) == 1, "expected one block with these words: correct them, or remove the entry"
    assert RUN_BY[page][words]
    assert [test for test in RUN_BY[page][words] if not is_there(test)] == []


def test_a_block_with_neither_is_found() -> None:
    page = "\n".join(
        [
            *("# Page", "", "```{toctree}", "other", "```", ""),
            *("```python", "known()", "```", "", "text", "", "    unknown --word", ""),
            *("<!-- not run: it takes a day -->", "```", "marked", "```", ""),
            *("<!-- not run: not directly above -->", "", "```", "far", "```", ""),
            *(":::{note}", "```", "inside", "```", ":::", "", "- item", "", "      in an item", ""),
            *("<!-- not run: -->", "```", "no reason", "```", ""),
            *("<!-- not run: both -->", "```", "known() again", "```", ""),
        ]
    )
    assert [each.partition(": ")[2] for each in _unexplained(page, ["known()"])] == [
        *("unknown --word", "far", "inside", "in an item", "no reason", "known() again")
    ]


def test_a_block_of_a_tutorial_that_is_neither_a_file_nor_commands_is_found() -> None:
    page = "\n".join(
        [
            *("Write `a/file.yaml`:", "", "```yaml", "mauve: 1", "```", ""),
            *("```console", "$ mauve list", "```", "", "Look:", "", "```yaml", "mauve: 2", "```", ""),
            *("<!-- not run: it takes a day -->", "```console", "$ mauve list", "```", ""),
        ]
    )
    assert [is_run(block, page) for block in blocks(page)] == [True, True, False, False]
