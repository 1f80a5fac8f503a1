"""What README and the pages of docs/ claim, and what fails when a claim is false.

A claim is quoted in the page's own words. Its proofs are tests, `stage/room/test_file.py::test_name` below
tests/ or mauve_examples/tests/, or `Suite.Name` in C++; programs that ctest runs, `ctest: NAME`; rows
of scripts/bench, `bench: WORDS`.
test_readme_claims.py holds this table to the pages and to what there is, and these pages to this table.
"""

PAGES_OF_CLAIMS = (
    "README.md",
    *(
        f"docs/concepts/{name}.md"
        for name in (
            "basic_elements",
            "components",
            "deployment",
            "failures_of_peers",
            "faults",
            "performance",
            "replacing",
            "resources",
            "rules_overview",
            "source_tree",
            "traces",
        )
    ),
    *(
        f"docs/howto/{name}.md"
        for name in (
            "compare_in_shadow",
            "install",
            "operate",
            "record_and_report",
            "reload_code",
            "see_values",
            "try_on_probation",
            "write_a_core",
        )
    ),
)
"""Each sentence of these is in the table. Of other pages only what is quoted."""


_REPORT = "python/trace/report/test"
_PEERS = "python/simulation/test_failures_of_peers.py::test_"
_PEERS_FAULTS = "python/simulation/test_faults_of_peers.py::test_"
_KERNEL_ALONE = "python/project/test_readme_examples.py::test_the_kernel_knows_neither_ros_nor_python"

_SHADOW = "python/control/test_shadow.py::test"
_PAGE_OF_SHADOW = "ros/executor/test_reload.py::test_the_commands_of_the_shadow_page"
_PROBATION = "python/control/test_probation.py::test"
_PAGE_OF_PROBATION = "ros/executor/test_reload.py::test_the_commands_of_the_probation_page"
_RELOAD = "python/control/test_reload.py::test"

CLAIMS: dict[str, tuple[str, ...]] = {
    # ---- the beginning
    "Rewire and re-implement a robot's software while it runs": (
        "ctest: sensor_breaks",
        "ros/executor/test_services.py::test_replace_core_in_flight_takes_over_the_count",
    ),
    "The control loops keep their rhythm": (
        "Rule7Simulated.ThousandsOfCommitsAtRandomInstantsChangeNothingOfTheRhythm",
        "bench: , nominal phase error",
    ),
    "A replaced core keeps its component waiting for some microseconds, and no component misses a release": (
        "Rule9Replace.AThousandTimesAtRandomPhasesMissesNoRelease",
        "bench: replace core of a running 1 kHz component with 100 us of work",
        "bench: , releases missed",
    ),
    "Its real-time executor hosts components in pinned `SCHED_FIFO` threads that share one epoch.": (
        "Rule5Deployment.ThreadsAreWhatWasAskedFor",
        "Rule5Deployment.AllComponentsShareOneEpochPublishedAfterAllAreReady",
    ),
    "It replaces a component's algorithm in flight, speaks ROS 2 topics and services,": (
        "ros/executor/test_services.py::test_replace_core_in_flight_takes_over_the_count",
    ),
    (
        "| **MAUVE RT** | at the pending instant, with the old one's state, and without a missed "
        "release | any components, wiring and properties | a thread for each component | |"
    ): (
        "Rule9Replace.AThousandTimesAtRandomPhasesMissesNoRelease",
        "python/project/test_readme_examples.py::test_the_smallest_component_is_replaced_live",
    ),
    "MAUVE RT connects to theirs by topics and services": (
        "ros/executor/test_services.py::test_replace_core_in_flight_takes_over_the_count",
    ),
    "It was made from the bag next to it (`docs/sample/metronome`)": (
        "python/project/test_sample.py::test_the_report_is_of_the_bag",
    ),
    "a component at 200 Hz whose core is replaced twice": (
        "python/project/test_sample.py::test_the_bag_has_what_readme_says",
    ),
    "In C++ it is the same three parts, in hard real time, and a file connects them:": (
        "python/project/test_readme_examples.py::test_listings_stand_in_the_sources",
    ),
    "`scripts/docs` builds these pages into `build/docs/html`, with a search that needs no network.": (
        "python/project/test_docs.py::test_the_search_works_from_files",
    ),
    "degrades by rules, and records": (
        "ros/supervisor/test_executor.py::test_a_core_is_replaced_in_flight_and_back",
    ),
    "rosbags from which timing is proved.": (
        "python/trace/test_kernel.py::test_swaps_are_as_the_kernel_reported_them",
    ),
    "In a change no component waits for another one": (
        "ros/executor/test_stop_wins.py::test_no_component_waits_for_one_that_still_executes",
    ),
    "The outcome names each component that missed a release, as a new fsm with another grid may do.": (
        "python/control/test_control.py::test_releases_that_were_missed_are_in_the_message",
    ),
    "A stop does not wait for a change": (
        "ros/executor/test_beside.py::test_a_stop_by_reconfigure_waits_for_no_preparation",
        "ros/executor/test_beside.py::test_a_stop_waits_for_no_stop_of_another_component",
    ),
    "a change of its component that is not decided yet is called off": (
        "ros/executor/test_stop_wins.py::test_a_stop_calls_off_a_commit_that_waits_for_another_component",
        "ros/executor/test_beside.py::test_a_stop_of_its_own_component_calls_the_change_off",
    ),
    "any other goes on beside it": (
        "ros/executor/test_beside.py::test_stop_start_and_list_wait_for_no_preparation",
    ),
    "Deactivation and the end of the process call all changes off, and their callers are told so": (
        "ros/executor/test_stop_wins.py::test_deactivate_waits_for_no_preparation",
        "ros/executor/test_stop_wins.py::test_the_end_waits_for_no_change",
    ),
    (
        "Both make outputs safe first, in C++: neither Python, nor a request, nor a console that "
        "is not read delays that."
    ): (
        "ros/executor/test_safe_stop.py::test_a_signal_waits_for_no_lock_of_the_interpreter",
        "ros/executor/test_safe_stop.py::test_a_console_that_nobody_reads_holds_up_nothing",
        "ros/executor/test_safe_stop.py::test_a_rules_file_that_is_a_pipe_is_refused_at_once",
    ),
    "SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1 and SIGUSR2 end the process in order": (
        "ros/executor/test_process.py::test_signal_seals_the_bag",
        "EndSignal.MakesOutputsSafe",
    ),
    (
        "When an executor's Python side is silent for `node_silent_after_s` (5 s), its C++ side "
        "logs an error;"
    ): ("ros/executor/test_safe_stop.py::test_a_node_whose_python_is_silent_says_so",),
    "What Python leaves unread for 0.2 s of `~/stop`, C++ carries out and answers": (
        "ros/executor/test_stop_guard.py::test_a_stop_is_carried_out_and_told_later",
        "ros/executor/test_stop_guard.py::test_what_hangs_is_stopped_by_force",
    ),
    "for a deactivation or shutdown it makes outputs safe, and the transition follows": (
        "ros/executor/test_stop_guard.py::test_a_transition_makes_outputs_safe_at_once_and_follows",
    ),
    (
        "a rule (`node_silent`) can act on that, and `READY=1`, `WATCHDOG=1` and `STOPPING=1` notify systemd."
    ): ("ros/executor/test_safe_stop.py::test_a_rule_acts_on_a_silent_python",),
    "A component that hangs is given up after 0.5 s, its outputs safe too.": (
        "ProcessEnd.AComponentThatHangsIsGivenUp",
    ),
    (
        "An executor carries out changes one after the other; one that finds another under way "
        "for 10 s is refused."
    ): ("ros/executor/test_stop_wins.py::test_a_part_may_ask_its_own_executor_while_it_is_configured",),
    (
        "Threads of one program prepare and make changes of different components in parallel, "
        "unless two of them add, remove or wire."
    ): (
        "ParallelChanges.WaitForNoPreparationOfOthers",
        "ParallelChanges.WaitForNoCommitOfOthers",
        "ParallelChanges.ThatAddOrRemoveGoOneAfterTheOther",
    ),
    "A faulted component gets a new core, or its present core is configured again; then it is started:": (
        "ros/executor/test_faulted_component.py::test_by_a_new_core_and_a_start",
        "ros/executor/test_faulted_component.py::test_by_configuring_it_anew_and_a_start",
        "ros/executor/test_faulted_component.py::test_by_the_command_line",
    ),
    "mauve replace-core /robot_1/executor guidance mauve_examples/Guidance": (
        "ros/executor/test_faulted_component.py::test_by_a_new_core_and_a_start",
        "ros/executor/test_faulted_component.py::test_by_configuring_it_anew_and_a_start",
        "ros/executor/test_faulted_component.py::test_by_the_command_line",
    ),
    # ---- two commands
    "nothing comes by pip,": (
        "python/project/test_package_xml.py::test_the_door_opens_with_rosdep_and_apt_alone",
    ),
    "the Python packages of Ubuntu 24.04 do as they are.": (
        "doors/test_apt_versions.py::test_a_run_is_started_changed_recorded_checked_and_reported",
    ),
    "YAML 1.2, where `on` and `yes` are text": ("python/yaml/test_text.py::test_scalars_of_yaml_1_2",),
    (
        "`scripts/demo` and `scripts/test` install what they need: system packages through apt "
        "(as root or with sudo, which may ask for your password;"
    ): ("python/project/test_scripts.py::test_a_missing_tool_is_among_the_packages_to_install",),
    "The first run takes about two minutes until the mission starts.": (
        "python/project/test_scripts.py::test_progress_says_how_far_what_and_how_long",
        "python/project/test_build.py::test_setup_tells_the_cpu_time_of_its_commands",
    ),
    (
        "The first run takes about two minutes until the mission starts, and tells how far it is "
        "and the CPU time of each step."
    ): (
        "python/project/test_scripts.py::test_progress_says_how_far_what_and_how_long",
        "python/project/test_build.py::test_setup_tells_the_cpu_time_of_its_commands",
    ),
    "The demo builds only what it runs": (
        "python/project/test_build.py::test_the_demo_builds_only_what_it_runs",
    ),
    (
        "`scripts/setup` builds the rest: basic elements, tutorials, listings, and the C++ form "
        "of the messages."
    ): ("python/project/test_build.py::test_who_asked_for_all_keeps_all",),
    (
        "Where `ccache` is installed (`scripts/test` installs it), clones on one machine share "
        "what they compiled."
    ): (
        "python/project/test_build.py::test_clones_in_different_folders_share_what_was_compiled",
        "python/project/test_scripts.py::test_ccache_comes_with_the_tests",
    ),
    "A sourced ROS 2 Jazzy is used when there is one, its wheels otherwise.": (
        "python/project/test_readme_scripts.py::test_a_sourced_jazzy_is_found_and_wheels_are_not_taken_for_one",
    ),
    "otherwise they say which), all else into `.venv`, `build/` and `install/` inside the clone.": (
        "python/project/test_scripts.py::test_without_a_terminal_the_command_to_type_is_told",
    ),
    "scripts/demo # sets everything up, builds, runs the mission, prints the story, writes the report": (
        "system/test_demo_mission.py::test_it_succeeds_and_says_so",
        "system/test_demo_mission.py::test_it_writes_what_it_promises",
    ),
    "scripts/test # sets everything up, builds, runs every test": (
        "python/project/test_readme_scripts.py::test_every_folder_of_tests_is_a_stage",
    ),
    "`--help` of either answers at once": (
        "python/project/test_scripts.py::test_help_needs_nothing_that_is_built_or_installed",
    ),
    (
        "`scripts/setup` says what it needs before it begins; [uninstall](uninstall.md) says how "
        "to remove all of it."
    ): (
        "python/project/test_scripts.py::test_the_plan_and_too_little_space_are_told_before_anything_is_begun",
    ),
    (
        "To colcon and rosdep the clone is one package, `mauve_rt`, which brings `mauve_msgs` and "
        "`mauve_examples`: a package that uses any of them says `<depend>mauve_rt</depend>`, and "
        "may `find_package(mauve_msgs)` then."
    ): ("doors/test_colcon.py::test_who_depends_on_mauve_rt_has_the_messages",),
    (
        "With `--symlink-install` an edit of a Python, architecture, rules or launch file is seen "
        "without a build."
    ): ("doors/test_colcon.py::test_symlink_install_shows_an_edit_without_a_build",),
    "In the demo two robots explore an office and agree over a radio link on who looks where.": (
        "system/test_demo_mission.py::test_coverage_is_a_share_and_grew",
    ),
    "In the demo two robots explore an office.": (
        "system/test_demo_mission.py::test_coverage_is_a_share_and_grew",
    ),
    "They agree over a radio link on who looks where; after 20 s the link is cut.": (
        "system/test_demo_parts.py::test_options_have_the_defaults_of_the_mission",
        "ros/test_radio.py::test_a_cut_link_carries_nothing_until_it_is_back",
    ),
    (
        "Each robot's supervisor notices the silence and replaces the core of its component "
        "`exploration` by one that decides alone, while the executor runs; when the link is back, "
        "so is the first algorithm."
    ): ("system/test_demo_mission.py::test_the_summary_tells_of_both_swaps_of_every_robot",),
    "a simulation of the same mission says what supervisors would have saved.": (
        "system/test_demo_simulated.py::test_without_supervisors_it_shows_what_they_would_have_saved",
    ),
    "Robots that drive into each other fail a mission": (
        "system/test_demo_simulated.py::test_it_says_whether_robots_ran_into_each_other",
        "python/test_collisions.py::test_a_collision_fails_the_mission",
    ),
    "`scripts/demo --no-supervisor` shows what happens otherwise: the robots stand still, and": (
        "system/test_demo_mission.py::test_without_supervisors_the_robots_stall",
    ),
    (
        "`scripts/demo --help` lists the options; `--map FILE.yaml` takes any map of the ROS map "
        "server within the limits below."
    ): (
        "system/test_demo_mission.py::test_maps_of_others_work_as_they_are",
        "system/test_demo_mission.py::test_maps_as_tools_write_them_work",
        "system/test_demo_bad_input.py::test_bad_maps",
    ),
    "The modes trinary, scale and raw give the cells that Nav2's map server for Jazzy publishes": (
        "MapServerRule.EveryGreyBecomesTheMapServersCell",
        "MapServerRule.SixteenBitsLoseTheLowerOnes",
        "MapServerRule.TheGammaOfAPngHasNoEffect",
        "MapServerRule.ColoursBecomeTheirLuma",
        "MapServerRule.WhatIsNotOpaqueIsUnknownSaveInModeRaw",
    ),
    "The mission drives on cells of value 0; all other cells are obstacles.": (
        "DiscCollision.CountsCellsThatAreNotFree",
    ),
    "A map whose origin has a yaw is turned upright, each cell by the nearest cell of the file": (
        "TurnedMaps.AQuarterTurnMovesEveryCellExactly",
        "TurnedMaps.EachCellHasTheStateBelowItsCentre",
    ),
    "The demo refuses, in one line with the remedy": ("system/test_demo_bad_input.py::test_bad_maps",),
    "- images other than PGM, PNG, and BMP without compression": (
        "BmpMaps.AreRefusedWithOneLineThatNamesWhatIsWrong",
        "BmpMaps.PalettesOfOneFourAndEightBits",
        "BmpMaps.ColoursOf32Bits",
        "MapFile.RefusesImagesThatCannotBeUsed",
    ),
    (
        "more than 4194304 cells (2048 x 2048), as robots plan in locked memory; a turned map "
        "counts with its corners; -"
    ): (
        "MapFile.RefusesImagesThatCannotBeUsed",
        "TurnedMaps.MayNotExceedTheLimitEither",
    ),
    "cells smaller than 1 mm or larger than 10 m; -": ("MapFile.RefusesWithOneLineThatNamesWhatIsWrong",),
    "thresholds other than `0 <= free_thresh <= occupied_thresh <= 1`, and maps without a free cell.": (
        "MapFile.RefusesWithOneLineThatNamesWhatIsWrong",
        "MapFile.RefusesImagesThatCannotBeUsed",
    ),
    "are read as their formats say; the map server's library reads some of them wrongly.": (
        "MapServerRule.SixteenBitsLoseTheLowerOnes",
        "MapServerRule.TheTransparentColourOfAPngIsUnknown",
    ),
    "Nav2 before 1.3.7 averaged colours and alpha": ("MapServerRule.ColoursBecomeTheirLuma",),
    (
        "`scripts/demo --simulated-time` runs the same mission in virtual time on one thread: "
        "robots, radio and supervisors' rules, without processes, ROS graph or real-time rights, "
        "many times faster than real time (it says how many)."
    ): (
        "system/test_demo_simulated.py::test_it_succeeds_without_any_process_of_its_own",
        "system/test_demo_simulated.py::test_it_says_how_fast_it_was",
    ),
    "Equal options give equal traces, bit for bit": (
        "system/test_demo_simulated.py::test_equal_seeds_make_equal_traces_and_figures",
    ),
    (
        "Story, report and bags are those of the real demo; times are of the model: execution "
        "takes what is declared,"
    ): ("system/test_demo_simulated.py::test_the_bags_hold_what_those_of_the_real_demo_hold",),
    (
        "[several_machines.md](../several_machines.md) says how robots on several hosts are set "
        "up, and what their clocks and other accounts have to do with it."
    ): (
        "ros/links/test_peers.py::test_it_is_enough_that_one_names_the_other_if_that_one_is_open",
        "ros/links/test_links.py::test_who_hears_nothing_acts_once_and_comes_back",
        "ros/cli/test_other_account.py::test_an_ordinary_user_reaches_an_executor_of_root",
    ),
    (
        "`scripts/demo --hosts` (as root) runs each robot on a machine of its own, made of Linux "
        "namespaces, with a real link between them: the cable is pulled out and put in again, and "
        "no process is in between."
    ): (
        "system/test_demo_hosts.py::test_a_real_link_is_cut_for_real",
        "system/test_demo_hosts.py::test_without_the_right_to_it_one_line_says_so",
    ),
    # ---- other ways in
    (
        "In a ROS 2 workspace: clone into `src/`, then `rosdep install --from-paths src -i` and "
        "`colcon build`;"
    ): (
        "doors/test_colcon.py::test_everything_is_where_ros_puts_it",
        "python/project/test_package_xml.py::test_what_runs_is_listed_exactly",
    ),
    "With pip, in a fresh virtual environment and a shell where no ROS is sourced:": (
        "doors/test_pip.py::test_programs_run_in_a_shell_with_nothing_set",
    ),
    (
        "`pip install .` brings ROS 2 Jazzy as wheels, `mauve`, and `lib/mauve_rt/executor` and "
        "`supervisor` in the environment; no variable has to be set."
    ): ("doors/test_pip.py::test_programs_run_in_a_shell_with_nothing_set",),
    (
        "`MAUVE_CMAKE_ARGS` passes CMake options, such as `-DMAUVE_BUILD_EXAMPLES=OFF`. pip needs "
        "g++, libpng, yaml-cpp and OpenSSL headers."
    ): ("doors/test_pip.py::test_environment_is_an_ament_prefix",),
    # ---- from another terminal
    "mauve list /robot_1/executor # what runs, on which CPU, at which priority, connected to what": (
        "python/cli/test_list_view.py::test_what_runs_on_which_cpu_at_which_priority_and_its_cores",
        "ros/cli/test_list.py::test_mauve_list_shows_what_is_connected",
    ),
    "mauve replace-core /robot_1/executor exploration mauve_examples/LocalExploration": (
        "ros/cli/test_verbs.py::test_verbs_do_what_they_say",
        "python/project/test_readme_examples.py::test_every_command_is_one_that_mauve_takes",
    ),
    "mauve reconfigure /robot_1/executor steps.yaml --dry-run # then without;": (
        "ros/cli/test_verbs.py::test_a_transaction_is_carried_out_and_reported_step_by_step",
        "python/project/test_readme_examples.py::test_the_steps_fit_the_mission",
    ),
    "mauve stop /robot_1/executor guidance": ("ros/cli/test_verbs.py::test_verbs_do_what_they_say",),
    "mauve start /robot_1/executor guidance": ("ros/cli/test_verbs.py::test_verbs_do_what_they_say",),
    "mauve events /robot_1/executor # as they happen, until Ctrl-C": (
        "ros/cli/test_verbs.py::test_events_are_followed",
    ),
    "mauve set /robot_1/executor control.max_speed 0.5": ("ros/cli/test_verbs.py::test_a_property_is_set",),
    (
        "The Tab key completes executors, components, the cores that may replace the present one, "
        "properties, resources and ports."
    ): (
        "python/cli/test_completion.py::test_values_are_resources_and_ports",
        "python/cli/test_completion.py::test_properties_are_completed",
        "python/cli/test_completion.py::test_executors_are_completed",
        "python/cli/test_completion.py::test_components_are_completed",
        "python/cli/test_completion.py::test_the_cores_that_may_replace_are_completed",
        "ros/cli/test_completion.py::test_names_of_a_running_executor_are_completed",
    ),
    "A background process asks the executors for these names, so the first Tab may show none.": (
        "ros/cli/test_completion.py::test_names_of_a_running_executor_are_completed",
        "python/cli/test_completion.py::test_nothing_is_known_and_ros_cannot_be_loaded",
    ),
    "Where the ROS 2 command line is installed, every verb is one of `ros2 mauve` too:": (
        "ros/cli/test_ros2_command.py::test_verbs_answer_as_those_of_mauve",
        "python/cli/test_ros2_entry_points.py::test_the_verbs_are_those_of_mauve",
    ),
    "`ros2 mauve list /robot_1/executor`, with completion, the same output and the same exit status.": (
        "ros/cli/test_ros2_command.py::test_verbs_are_completed",
        "ros/cli/test_completion.py::test_names_of_a_running_executor_are_completed",
        "ros/cli/test_ros2_command.py::test_verbs_answer_as_those_of_mauve",
    ),
    "ros2 service call /robot_1/executor/replace_core mauve_msgs/srv/ReplaceCore": (
        "python/project/test_readme_examples.py::test_service_calls_have_fields_of_their_services",
    ),
    "Several changes that take effect together, or not at all, are a YAML list of steps:": (
        "python/project/test_readme_examples.py::test_the_steps_fit_the_mission",
    ),
    "a report per step, or the step that failed and why": (
        "ros/cli/test_verbs.py::test_a_transaction_is_carried_out_and_reported_step_by_step",
    ),
    (
        "`ros2 run mauve_rt executor --ros-args -p architecture:=FILE [-p bag:=DIR]`; without the "
        "ROS 2 command line `install/lib/mauve_rt/executor` takes the same arguments."
    ): ("ros/cli/test_ros2_command.py::test_ros2_run_starts_an_executor",),
    (
        "Its interface is in `mauve_msgs` (`~/list_components`, `~/stop`, `~/start`, "
        "`~/replace_core`, `~/reconfigure`, `~/reload`, `~/list_rules`, `~/load_rules`, "
        "`~/read_values`, `~/mirror`, `~/start_recording`, "
        "`~/stop_recording`, `~/state`, `~/events`, `~/decisions`, `/diagnostics`)."
    ): ("ros/cli/test_list.py::test_the_interface_is_the_one_that_readme_lists",),
    "On an installed Jazzy, with its supervisor and everything remapped as you like:": (
        "ros/test_launch.py::test_an_executor_with_its_supervisor",
    ),
    (
        "ros2 launch mauve_rt executor.launch.py architecture:=FILE rules:=FILE "
        "namespace:=/robot_1 bag:=DIR \\"
    ): ("ros/test_launch.py::test_an_executor_with_its_supervisor",),
    (
        "ros2 launch mauve_examples exploration.launch.py robots:=2 map:=office link_loss_at:=20 "
        "link_back_at:=45"
    ): (
        "ros/test_launch.py::test_the_mission_loses_its_link_and_gets_it_back",
        "python/project/test_readme_examples.py::test_launch_arguments_are_declared",
    ),
    "`--show-args` lists all arguments": (
        "python/node/test_launch_files.py::test_every_argument_is_declared_once_and_used",
    ),
    "Both files are checked before anything starts": (
        "ros/test_launch.py::test_bad_arguments_start_nothing",
    ),
    (
        "Names in architecture and rules files are relative to the node's namespace and remapped "
        "as those of any ROS node:"
    ): ("ros/test_names.py::test_an_executor_s_names_are_remapped",),
    (
        "`-r count:=tally`, `-r executor:count:=tally`, `-r __node:=boss`, `-r __ns:=/robot_7`; a "
        "supervisor finds a renamed executor by `-r executor:=boss`."
    ): ("ros/test_names.py::test_a_supervisor_s_names_are_remapped",),
    (
        "**Parameters.** Every property of every component is a parameter "
        "`<component>.<property>` of its executor, with type, unit, range and description."
    ): ("ros/executor/test_parameters.py::test_parameters_are_the_properties",),
    (
        "It has the kernel's value, whichever tool changed it; a change is checked and carried "
        "out by the kernel, all or none, and told on `~/events`."
    ): ("ros/executor/test_parameters.py::test_parameters_are_the_properties",),
    "ros2 param set /robot_1/executor control.max_speed 0.5": (
        "ros/executor/test_parameters.py::test_parameters_are_the_properties",
    ),
    (
        "ros2 run mauve_rt executor --ros-args -p architecture:=FILE --params-file robots.yaml -p "
        "control.max_speed:=0.5"
    ): ("python/node/test_arguments.py::test_parameters_of_one_file_for_several_robots",),
    (
        "A parameter file may have a section for each robot (`/robot_1/executor: "
        "{ros__parameters: {control: {max_speed: 0.5}}}`);"
    ): ("python/node/test_arguments.py::test_parameters_of_one_file_for_several_robots",),
    "an unknown name or a bad value starts nothing and says why.": (
        "ros/executor/test_process.py::test_bad_parameters",
        "python/node/test_arguments.py::test_an_unknown_parameter_is_refused",
        "python/node/test_arguments.py::test_bad_properties",
    ),
    "What is read only once is read-only: settings of the executor (": (
        "ros/executor/test_settings.py::test_what_is_read_once_is_read_only",
        "ros/executor/test_settings.py::test_a_structural_property_is_set_beside_its_reader",
    ),
    (
        "`executor --help` lists them), and a *structural* property, such as the metronome's "
        "period, which its fsm reads when it is defined:"
    ): ("ros/executor/test_settings.py::test_help_starts_nothing",),
    "set it in the transaction that replaces its reader.": (
        "StructuralThreads.BesideTheFsmThatReadsItItTakesEffectInEitherOrder",
        "ros/executor/test_settings.py::test_a_structural_property_is_set_beside_its_reader",
    ),
    "A state that does not end (": (
        "ros/executor/test_hung.py::test_a_hung_component_is_told_until_it_goes_on",
    ),
    (
        "`mauve stop --force` gives such a component up: its outputs are written, it is FAULTED, "
        "and its thread is left behind."
    ): (
        "Rule11Force.AStopByForceGivesUpAStateThatDoesNotEnd",
        "ros/executor/test_force.py::test_a_hung_component_is_stopped_by_force",
    ),
    "A component that comes to a wait in time is stopped as ever": (
        "Rule11Force.AStateEndsOrIsGivenUpAndNeverBoth",
        "HostConformance.ForceHarmsNobodyWhoIsWell",
    ),
    "`mauve reconfigure --force` (in a file `force: true`) removes one whose thread does not come back:": (
        "Rule11Force.ARemovalByForceGoesOnWithoutTheThread",
        "ros/executor/test_force.py::test_a_hung_component_is_removed_by_force",
    ),
    (
        "What requests may take is limited by the executor's parameters `max_request_bytes`, "
        "`max_requested_bytes` and `max_requested_priority`."
    ): (
        "ros/executor/test_request_limits.py::test_memory_and_priority_that_requests_may_take",
        "ros/executor/test_request_limits.py::test_limits_are_parameters",
    ),
    "A port has to be connected unless its shell declares it optional": (
        "ros/executor/test_required_ports.py::test_a_required_port_stays_connected",
        "python/model/test_misfits.py::test_an_unconnected_call_port_is_refused",
    ),
    "Its fields are compared with the fields of the message": (
        "python/model/test_misfits.py::test_a_struct_unlike_its_message_is_refused",
        "python/model/test_misfits.py::test_a_services_response_is_held_against_the_service",
    ),
    "A plain struct declares once which message or service it represents": (
        "python/model/test_misfits.py::test_a_struct_unlike_its_message_is_refused",
        "python/model/test_misfits.py::test_a_services_response_is_held_against_the_service",
    ),
    "The executor runs them itself (`-p rules:=FILE`), on native threads next to the components": (
        "ros/executor/test_rules.py::test_acts_undoes_and_tells",
    ),
    "The new parts of a rule are prepared while the rule is armed": (
        "bench: , later than 1 period + 1 ms",
        "RuleRunnerTest.PreparesNothingWhenItIsTime",
        "RuleRunnerTest.ActsWhileNothingCanBePrepared",
        "ros/executor/test_rules.py::test_what_cannot_be_made_ready_is_an_error_at_once",
    ),
    "No rule waits for a component that another rule is about": (
        "bench: the same beside a lower rule whose component hangs",
        "RuleRunnerTest.ActsWhileAnothersComponentDoesNotComeToAWait",
        "RuleRunnerTest.PreparesWhileAnothersPartIsSlow",
    ),
    "A rule whose own target hangs can stop that target (`otherwise`)": (
        "RuleRunnerTest.MakesOutputsSafeWhereItsComponentHangs",
        "RuleRunnerTest.StopsWhereWhatItDoesCannotBeMadeReady",
    ),
    "| `mauve rules list` | shows the rules of an executor: armed, true, time until the next action |": (
        "ros/executor/test_rules.py::test_the_command_lists_and_loads",
    ),
    "So a rule acts while a component keeps Python's interpreter": (
        "ros/executor/test_rules.py::test_acts_while_a_component_in_python_keeps_the_interpreter",
    ),
    "and while its supervisor is stopped or dead": (
        "ros/executor/test_rules.py::test_acts_without_its_supervisor",
    ),
    "Every decision is published on `~/decisions` and recorded in the bag": (
        "ros/executor/test_rules.py::test_acts_undoes_and_tells",
        "system/test_demo_simulated.py::test_the_bags_hold_what_those_of_the_real_demo_hold",
    ),
    "A part that can no longer be prepared is an ERROR in `/diagnostics` at once": (
        "ros/executor/test_rules.py::test_what_cannot_be_made_ready_is_an_error_at_once",
    ),
    "`~/load_rules` replaces the present rules by the rules of a file, all or none": (
        "ros/executor/test_rules.py::test_rules_are_loaded_anew_whole_or_not_at_all",
    ),
    (
        "The **supervisor**, with the same file, is the second line: it runs the rules that are "
        "`in: supervisor`, and those that the executor does not run."
    ): ("ros/supervisor/test_executor.py::test_rules_that_the_executor_would_refuse_are_told_at_arming",),
    "A supervisor that starts while an effect is already in place takes it over": (
        "ros/supervisor/test_executor.py::test_a_supervisor_started_anew_undoes_what_the_one_before_did",
        "ros/executor/test_rules.py::test_takes_up_what_is_in_effect",
    ),
    "Conditions are combined by `all`, `any`, `not`, `at_least`, `for_s` and `within_s`": (
        "python/supervision/test_rule_trees.py::test_what_is_combined",
        "python/supervision/test_rule_trees.py::test_a_part_that_must_hold_without_a_break",
        "python/supervision/test_rule_trees.py::test_what_held_a_while_ago",
    ),
    "Of rules with different actions for one component, the rule of the highest priority decides": (
        "python/supervision/test_rule_trees.py::test_of_two_that_hold_the_higher_decides_and_the_lower_says_so_once",
    ),
    "| `mauve rules check FILE` | finds errors in rules and says how long each may take at most |": (
        "python/cli/test_rules.py::test_a_rule_that_can_never_hold",
        "python/cli/test_rules.py::test_two_that_want_different_things_at_once",
        "python/cli/test_rules_bounds.py::test_in_the_executor",
    ),
    (
        "| `mauve rules try FILE SCRIPT` | plays a script to them in virtual time, shows and "
        "draws their decisions |"
    ): ("python/cli/test_rules_try.py::test_the_story_and_the_timeline_of_the_documentation",),
    "| `mauve rules explain BAG` | shows why rules acted, or did not act |": (
        "python/cli/test_rules_explain.py::test_the_story_has_each_decision_with_its_reason",
        "python/cli/test_rules_explain.py::test_why_a_rule_did_not_act",
    ),
    (
        "| `mauve rules replay FILE BAG` | shows the actions that other rules would have taken in "
        "a recorded run |"
    ): (
        "python/cli/test_rules_replay.py::test_other_rules_differ",
        "system/test_demo_mission.py::test_its_rules_replayed_do_what_they_did",
    ),
    "A class installed meanwhile is found": (
        "ros/executor/test_plugins_installed_anew.py::test_a_core_installed_meanwhile_is_taken",
    ),
    "Rebuilt code is [loaded by `mauve reload`](reload_code.md).": (
        "ros/executor/test_reload.py::test_the_commands_of_the_page",
    ),
    # ---- probation
    "mauve replace-core /robot_1/executor control my_robot/Pid2 --probation 5": (_PAGE_OF_PROBATION,),
    (
        "mauve replace-core /robot_1/executor control my_robot/Pid2 --probation 5 --revert-on "
        "fault --revert-on overrun \\"
    ): (_PAGE_OF_PROBATION,),
    "--revert-on '{output: command.linear.x, minimum: -1, maximum: 1}'": (_PAGE_OF_PROBATION,),
    "mauve reload /robot_1/executor my_robot --probation 5 --probation-releases 100": (_PAGE_OF_PROBATION,),
    "mauve list /robot_1/executor # who is on probation, and the last verdicts": (_PAGE_OF_PROBATION,),
    (
        "While a core is on probation, the old core stays configured, with the state that it had "
        "when it was replaced."
    ): (
        f"{_PROBATION}_a_violation_puts_the_old_core_back",
        "Probations.AFaultPutsTheOldCoreBack",
    ),
    "A violation puts the old core back.": (f"{_PROBATION}_a_violation_puts_the_old_core_back",),
    ("The component's own thread finds the violation and puts the core back: no other thread takes part."): (
        "Probations.EachRandomlyBadCoreIsRevertedByTheNextRelease",
        "ProbationThreads.TheWayBackAllocatesNothing",
    ),
    (
        "| `fault` | an exception, or a state that lasts longer than declared | at once; the "
        "component goes on in the initial state at its next instant |"
    ): ("Probations.AFaultPutsTheOldCoreBack",),
    "| `overrun` | the component enters a wait after its end | in that wait |": (
        "Probations.AnOverrunPutsTheOldCoreBackWithinTheWait",
    ),
    "| `over_declared` | a state lasts longer than its `max_execution` | as after a fault |": (
        "Probations.AnExecutionOverItsBoundPutsTheOldCoreBack",
    ),
    "| `nan` | a number of any output is NaN | in the wait that follows |": (
        f"{_PROBATION}_a_violation_puts_the_old_core_back",
    ),
    (
        "| `{output: PORT.FIELD, minimum: X, maximum: Y}` | the number is beyond its limits, or "
        "NaN | in the wait that follows |"
    ): (
        f"{_PROBATION}_a_violation_puts_the_old_core_back",
        "Probations.AValueThatBreaksALimitIsNotWritten",
    ),
    "The default is `fault` and `nan`.": (f"{_PROBATION}_a_violation_puts_the_old_core_back",),
    "A value that breaks a limit is not written: consumers keep the value before it.": (
        "Probations.AValueThatBreaksALimitIsNotWritten",
    ),
    "The next release runs the old core.": ("Probations.EachRandomlyBadCoreIsRevertedByTheNextRelease",),
    "The verdict comes on `~/events`, in the log and in `mauve list`, with the reason:": (
        _PAGE_OF_PROBATION,
    ),
    "| passed | the time is over without a violation; the old core is retired |": (
        f"{_PROBATION}_a_core_that_does_nothing_wrong_passes",
        "Probations.ACoreWithoutViolationPasses",
    ),
    "| reverted | the old core is back |": (f"{_PROBATION}_a_violation_puts_the_old_core_back",),
    (
        "| inconclusive | the new core stays, but nothing is known: there were too few releases, "
        "or something else ended the probation |"
    ): (
        f"{_PROBATION}_too_few_releases_are_inconclusive",
        "Probations.AnotherCoreEndsItInconclusive",
    ),
    "A second change of the component's core, fsm or shell ends a probation as inconclusive.": (
        "Probations.AnotherCoreEndsItInconclusive",
        "Probations.AnotherFsmEndsItInconclusive",
    ),
    "A stop does not end it: the time goes on.": ("Probations.AStoppedComponentsProbationEndsByTheClock",),
    "A shutdown of the executor ends it as inconclusive.": ("Probations.AShutdownEndsItInconclusive",),
    "Properties and connections may change: they stay as they are when the old core goes back.": (
        "Probations.PropertiesAndConnectionsDoNotEndIt",
    ),
    "A reload on probation keeps the shell, which must not have changed.": (
        f"{_PROBATION}_a_changed_shell_cannot_be_on_probation",
    ),
    "Where one component goes back, the whole reload goes back.": (
        f"{_PROBATION}_a_reload_on_probation_goes_back_as_a_whole",
    ),
    (
        "For any other condition, write a [rule](../rules.md) with the step `revert_core`, or "
        "send that step by `mauve reconfigure`."
    ): (
        f"{_PROBATION}_a_step_puts_the_old_core_back",
        "ros/executor/test_reload.py::test_a_rule_puts_the_old_core_back",
    ),
    "Without a probation the step does nothing.": (f"{_PROBATION}_a_step_puts_the_old_core_back",),
    "A step of kind `replace_core` takes a probation as its value:": (
        f"{_PROBATION}_a_violation_puts_the_old_core_back",
    ),
    "State fields ([MAUVE_STATE](reload_code.md)) are copied, so the old core keeps its own.": (
        f"{_PROBATION}_a_violation_puts_the_old_core_back",
    ),
    "[On probation](try_on_probation.md), rebuilt code goes back by itself after a fault.": (
        f"{_PROBATION}_a_reload_on_probation_goes_back_as_a_whole",
    ),
    # ---- shadow
    "[In its shadow](compare_in_shadow.md), new code is compared with the present code.": (_PAGE_OF_SHADOW,),
    "mauve shadow /robot_1/executor control my_robot/Pid2 --budget-us 50": (_PAGE_OF_SHADOW,),
    "mauve shadow /robot_1/executor # how the outputs differ": (_PAGE_OF_SHADOW,),
    ("mauve shadow /robot_1/executor control --promote # the candidate becomes the core, with its state"): (
        _PAGE_OF_SHADOW,
        f"{_SHADOW}_the_warm_candidate_is_promoted",
    ),
    "mauve shadow /robot_1/executor control --end": (_PAGE_OF_SHADOW,),
    ("A candidate core runs in parallel with the live core, on the same inputs of the same releases."): (
        "Shadows.TheCandidateReadsWhatTheLiveCoreReadsAtTheSameInstants",
    ),
    "Its outputs reach no resource.": (f"{_SHADOW}_the_difference_of_each_output_is_told",),
    (
        "It runs on an ordinary thread below all components: a release for which it is late is "
        "skipped and counted."
    ): (
        "Shadows.ACandidateOverItsBudgetCostsNobodyElse",
        "ShadowThreads.AComponentIsNotKeptWaitingByACandidateThatHangs",
    ),
    (
        "In each release, the live component copies its inputs and outputs for the candidate, and "
        "wakes that thread."
    ): (
        "Shadows.TheCandidateReadsWhatTheLiveCoreReadsAtTheSameInstants",
        "ShadowThreads.TheLiveThreadAllocatesNothing",
    ),
    (
        "This adds 1 to 2 us of CPU time to a release with two ports of 16 bytes, nearly all of "
        "them for the wake-up ([measured](../concepts/performance.md))."
    ): (
        "bench: CPU time that a shadow adds to each release of a 1 kHz component",
        "python/project/test_bench_micro.py::test_a_shadow_costs_what_it_adds",
    ),
    "The budget is the execution time of the candidate for one release, on average.": (
        "Shadows.ACandidateOverItsBudgetCostsNobodyElse",
    ),
    "A release that takes longer is paid for by releases that are skipped.": (
        "Shadows.ACandidateOverItsBudgetCostsNobodyElse",
    ),
    (
        "For each number of each output, `mauve shadow` and `/diagnostics` show the largest "
        "difference, the root mean square, and how often the candidate wrote NaN."
    ): (
        _PAGE_OF_SHADOW,
        f"{_SHADOW}_the_difference_of_each_output_is_told",
    ),
    ("For each output they show the lag: by how many releases the candidate's first number comes later."): (
        "Shadows.ACandidateThatLagsIsFound",
    ),
    "A bag has the same figures, once a second and after the end of the shadow.": (
        f"{_SHADOW}_a_bag_has_a_message_each_second_and_one_after_the_end",
        f"{_SHADOW}_a_bag_that_ends_has_the_last_figures_of_a_shadow_that_runs",
        _PAGE_OF_SHADOW,
    ),
    '`mauve report DIR` shows them in the section "Shadows".': (
        "python/trace/test_shadows.py::test_the_report_has_a_section_of_shadows",
        _PAGE_OF_SHADOW,
    ),
    "A fault of the candidate ends its shadow.": (
        f"{_SHADOW}_a_candidate_that_writes_nan_or_raises_harms_nobody",
    ),
    "So does a change of the component's parts or wiring.": ("Shadows.OtherChangesEndTheShadow",),
    "The component goes on.": (f"{_SHADOW}_a_candidate_that_writes_nan_or_raises_harms_nobody",),
    "A component has one shadow at most.": ("Shadows.WhatCannotBeShadowedIsRefused",),
    "Components with call ports or event waits have none, because a call has effects.": (
        "Shadows.CallPortsAreRefused",
        "Shadows.TextsAndEventWaitsAreRefused",
    ),
    (
        "By `mauve reconfigure` the steps are `shadow` (value `{budget_us: 50}`), `end_shadow` and `promote`."
    ): (
        f"{_SHADOW}_the_difference_of_each_output_is_told",
        f"{_SHADOW}_the_warm_candidate_is_promoted",
    ),
    # ---- rebuilt code
    "mauve reload /robot_1/executor # all code that was rebuilt since it was loaded": (
        "ros/executor/test_reload.py::test_the_commands_of_the_page",
    ),
    "mauve reload /robot_1/executor my_robot # one package; a component's name serves as well": (
        "ros/executor/test_reload.py::test_the_commands_of_the_page",
        f"{_RELOAD}_a_module_comes_with_the_modules_that_it_uses",
    ),
    "mauve list /robot_1/executor # the generation of each core, and when it was built": (
        "ros/executor/test_reload.py::test_the_commands_of_the_page",
    ),
    "mauve reload /robot_1/executor --back # the code of before": (
        "ros/executor/test_reload.py::test_the_commands_of_the_page",
        f"{_RELOAD}_there_is_a_way_back_and_forward_again",
    ),
    "A reload reads the lists of plug-ins again.": (
        "ros/executor/test_reload.py::test_a_core_that_is_new_in_the_package",
    ),
    "It loads each rebuilt library as a private copy, in addition to the old one.": (
        f"{_RELOAD}_the_file_may_be_overwritten_while_its_copy_runs",
    ),
    "A build may overwrite the file at any time.": (
        f"{_RELOAD}_the_file_may_be_overwritten_while_its_copy_runs",
    ),
    (
        "A rebuilt Python module is loaded under a name of its own, together with the modules of "
        "the workspace that it uses."
    ): (f"{_RELOAD}_a_module_comes_with_the_modules_that_it_uses",),
    "One transaction then replaces the parts of all components that use the code.": (
        f"{_RELOAD}_rebuilt_code_is_put_in_force",
        "Handover.ShowsACoreOfAnotherGenerationAsAStranger",
    ),
    "`adopt` and `take` are called as in any replacement, and no release is missed.": (
        f"{_RELOAD}_rebuilt_code_is_put_in_force",
        "Handover.ShowsACoreOfAnotherGenerationAsAStranger",
    ),
    "[`mauve dev`](develop_live.md) builds, tests and reloads at each save.": (
        "ros/cli/test_dev.py::test_a_save_leads_to_new_code",
    ),
    "Each reload makes a **generation**.": (f"{_RELOAD}_there_is_a_way_back_and_forward_again",),
    "Nothing that was loaded is ever closed, so `--back` needs no build.": (
        f"{_RELOAD}_there_is_a_way_back_and_forward_again",
    ),
    "`mauve reload` goes forward again, to the code on the disk.": (
        f"{_RELOAD}_there_is_a_way_back_and_forward_again",
    ),
    (
        "Until a reload, a request for a part of rebuilt code is refused: the old code never runs "
        "under the name of the new code."
    ): (
        f"{_RELOAD}_a_core_of_rebuilt_code_is_not_taken_without_a_reload",
        "ros/executor/test_plugins_installed_anew.py::test_a_library_that_was_rebuilt_is_told",
        "ros/executor/test_plugins_installed_anew.py::test_a_python_module_that_was_changed_is_told",
    ),
    "Two builds of a class may have different layouts.": (
        "Handover.ShowsACoreOfAnotherGenerationAsAStranger",
    ),
    "So a core sees nothing of a core of another generation but its state fields:": (
        "Handover.ShowsACoreOfAnotherGenerationAsAStranger",
    ),
    "A core takes over each field of the same name and type from the core that it replaces.": (
        f"{_RELOAD}_rebuilt_code_is_put_in_force",
        f"{_RELOAD}_from_cpp_to_python_and_back_the_state_goes_along",
    ),
    "The two cores may be of different builds, or one in C++ and one in Python.": (
        f"{_RELOAD}_rebuilt_code_is_put_in_force",
        f"{_RELOAD}_from_cpp_to_python_and_back_the_state_goes_along",
    ),
    "The names of C++ members lose the `_` at their end.": ("Handover.CopiesTheFieldsOfTheSameNameAndType",),
    "The reply lists the fields that are taken over, and those that do not fit, with the reason.": (
        f"{_RELOAD}_state_that_does_not_fit_is_told",
        "Handover.CopiesTheFieldsOfTheSameNameAndType",
    ),
    "The fields are copied before `take` is called.": (
        f"{_RELOAD}_state_that_does_not_fit_is_told",
        "Handover.CopiesTheFieldsOfTheSameNameAndType",
    ),
    (
        "A field is a number, an array of numbers, a bounded text, or a trivially copyable struct "
        "of `MAUVE_TYPE`."
    ): (
        "Handover.CopiesTheFieldsOfTheSameNameAndType",
        "Handover.TakesNoStructOfAnotherLayout",
    ),
    "The type of a struct includes its layout.": (
        "Handover.CopiesTheFieldsOfTheSameNameAndType",
        "Handover.TakesNoStructOfAnotherLayout",
    ),
    "`adopt` and `take` see a core of another generation as one of no known C++ type.": (
        "Handover.ShowsACoreOfAnotherGenerationAsAStranger",
    ),
    "A property that was never set takes the default of the new shell.": (
        f"{_RELOAD}_there_is_a_way_back_and_forward_again",
    ),
    "All other properties keep their values, and all ports their connections.": (
        f"{_RELOAD}_a_property_that_was_set_keeps_its_value",
        f"{_RELOAD}_another_shell_comes_with_its_component",
    ),
    "A process of its own tries the new code first.": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    "Each of these is refused before anything changes:": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    (
        "| crashes, or does not end, when it is loaded | `crashed (SIGSEGV: ...)`, `does not end "
        "within 10 s` |"
    ): (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
        "python/model/test_plugin_trial.py::test_static_initialiser_that_does_not_end",
    ),
    "| lacks a symbol | `undefined symbol: ...` |": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    "| is a file that a build still writes | `wait for the end of the build` |": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    ("| was built against another version of MAUVE RT | `built against another version of MAUVE RT` |"): (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    "| has another layout of a data type | `its layout has changed`, with the field |": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    "| lacks a part that a component has | `is gone from the new code` |": (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    ("| has a shell without a port that is connected | `the new shell lacks a port that is connected` |"): (
        f"{_RELOAD}_what_does_not_fit_is_refused_before_anything_changes",
    ),
    (
        "A core of another library that was compiled for the old members of a changed shell is "
        "refused as well, until its package is built and reloaded."
    ): (f"{_RELOAD}_cores_of_other_libraries_have_to_be_built_with_a_changed_shell",),
    "A resource keeps the code that it was made with; the reply names such resources.": (
        f"{_RELOAD}_a_resource_keeps_its_code",
    ),
    "`--dry-run` only tries and checks the code.": (f"{_RELOAD}_a_dry_run_changes_nothing",),
    "**Lifecycle.** The executor is a managed node.": (
        "ros/executor/test_process.py::test_lifecycle_step_by_step",
    ),
    (
        "A transition that fails for a reason you can correct leaves everything as it was; "
        "anything unexpected goes through the error state, where all is released."
    ): ("ros/executor/test_lifecycle.py::test_failures_and_errors_are_told_and_leave_nothing_behind",),
    "`~/state` has the reason in `error`": (
        "ros/executor/test_lifecycle.py::test_failures_and_errors_are_told_and_leave_nothing_behind",
    ),
    (
        "**Diagnostics.** `/diagnostics` warns from the figures on that the file names, for all "
        "components or for one, counted since the last status, a second before:"
    ): (
        "ros/executor/test_diagnostics.py::test_figures_are_held_against_the_thresholds_of_the_file",
        "python/project/test_readme_examples.py::test_the_pieces_of_architecture_files_are_accepted",
    ),
    (
        "**Anyone on the ROS domain can call these services.** So all programs of MAUVE RT, "
        "however installed, stay on this machine unless `ROS_AUTOMATIC_DISCOVERY_RANGE` says "
        "otherwise (`SUBNET`); use DDS Security before you open it."
    ): (
        "ros/test_discovery.py::test_only_who_is_told_so_listens_to_the_network",
        "ros/test_discovery.py::test_another_machine_sees_an_executor_only_where_it_was_opened",
        "ros/links/test_closed_door.py::test_nothing_from_another_machine_comes_through_a_closed_door",
    ),
    # ---- record a run
    "From the start with `-p bag:=DIR`, as the mission's robots are, or while an executor runs:": (
        "ros/executor/test_process.py::test_signal_seals_the_bag",
    ),
    (
        "mauve record start /executor before_lunch --topic /joy:sensor_msgs/msg/Joy # below the "
        "executor's parameter bags; default: where it was started"
    ): ("ros/executor/test_recording.py::test_a_bag_begun_and_ended_while_the_executor_runs",),
    "mauve record stop /executor": (
        "ros/executor/test_recording.py::test_a_bag_begun_and_ended_while_the_executor_runs",
    ),
    (
        'ros2 service call /executor/start_recording mauve_msgs/srv/StartRecording "{bag: '
        'after_lunch, split_s: 30}"'
    ): ("python/project/test_readme_examples.py::test_service_calls_have_fields_of_their_services",),
    (
        "A bag is a rosbag2 folder with MCAP files: every record of every component's thread, the "
        "messages of bound topics, `~/state` and `~/events`, the topics you name (`record_topics` "
        "of the executor, `--topic` here), and what the architecture was,"
    ): (
        "python/trace/test_recorder.py::test_records_and_words_are_in_the_bag",
        "ros/executor/test_process.py::test_further_topics_are_recorded",
    ),
    "all on one time base and": (
        "python/trace/test_recorder.py::test_messages_lie_on_the_time_base_of_the_records",
    ),
    "with the definitions of all types.": (
        "python/trace/test_definitions.py::test_the_text_is_enough_to_read_the_message",
        "python/trace/test_reader.py::test_a_bag_moved_elsewhere_needs_nothing_installed",
    ),
    (
        "It goes on in a new file every minute (`bag_split_s`, `bag_split_bytes`), each of which "
        "can be read alone."
    ): (
        "python/trace/test_repair.py::test_a_split_bag_is_one_bag_and_each_file_can_be_read_alone",
        "python/trace/test_recorder.py::test_what_latched_topics_said_last_is_in_every_file",
    ),
    "Ten times a second it becomes a finished bag:": (
        "python/trace/test_bag.py::test_every_flush_leaves_a_finished_bag",
    ),
    "after `kill -9`, whenever that comes, `ros2 bag`, `rosbags` and `mcap` open it as it is, and": (
        "python/trace/test_bag.py::test_kill_9_at_any_moment_loses_nothing_that_was_flushed",
        "ros/executor/test_process.py::test_killed_executor_leaves_a_bag_that_opens",
        "python/trace/test_disk.py::test_a_kill_in_a_write_leaves_whole_files",
        "python/trace/test_strangers.py::test_all_find_the_same",
    ),
    (
        "A process of its own, `bag_keeper`, writes the files, since Linux gives up a write "
        "halfway when its process is killed."
    ): (
        "python/trace/test_disk.py::test_a_kill_in_a_write_leaves_whole_files",
        "ros/executor/test_recording.py::test_a_keeper_writes_the_bag",
    ),
    "what is missing is less than the last 200 ms.": (
        "python/trace/test_bag.py::test_every_flush_leaves_a_finished_bag",
        "python/trace/test_bag.py::test_kill_9_at_any_moment_loses_nothing_that_was_flushed",
        "bench: lost by kill -9 while recording 100,000 records a second, worst",
    ),
    "A full disk ends the recording, with an error on `/diagnostics`, never the executor": (
        "ros/executor/test_recording.py::test_a_full_disk_ends_the_recording_with_a_diagnostic",
    ),
    "Losses are counted in the bag, never silent": (
        "TraceRing.CountsWhatItCannotKeep",
        "python/trace/test_recorder.py::test_what_exceeds_the_queue_is_dropped_and_counted",
        "python/trace/test_reader.py::test_loss_is_known_from_sequences_and_counters",
    ),
    "mauve trace info DIR # components, records, topics, files; --json": (
        "python/cli/test_trace.py::test_info",
    ),
    (
        "mauve trace check DIR # finished? whole? anything missing? a change split? exit status 1 "
        "if not in order"
    ): (
        "python/cli/test_trace.py::test_check_tells_losses",
        "python/trace/test_split_changes.py::test_the_verb_says_wrong_and_fails",
    ),
    "mauve trace repair DIR # of a bag that something else tore: keeps all that is whole": (
        "python/cli/test_trace.py::test_check_and_repair",
    ),
    (
        "mauve trace stats DIR # latencies, execution and service times, contention, overruns, "
        "reconfigurations; --json"
    ): ("python/cli/test_trace.py::test_stats",),
    (
        "mauve trace export DIR... # a file for ui.perfetto.dev; --format csv: tables, one for "
        "each topic, too; of a folder of bags, too"
    ): (
        "python/cli/test_trace_export.py::test_perfetto_is_the_default",
        "python/cli/test_trace_export.py::test_csv",
    ),
    "A value is a numeric field of the recorded messages.": (
        "python/trace/test_values.py::test_numbers_and_short_arrays_are_values_but_no_texts_times_and_long_arrays",
    ),
    (
        "`/beat.data` is the field `data` of the topic `/beat`; `pose.x` is the field `x` of the topic "
        "`/executor/values/pose`, which has the values of the resource `pose`."
    ): (
        "python/trace/test_values.py::test_values_of_resources_come_first_and_are_called_by_the_resource",
        "python/project/test_readme_examples.py::test_the_python_example_plots_a_value",
    ),
    "Its times are those of `trace.frames`: ns of CLOCK_MONOTONIC.": (
        "python/trace/test_values.py::test_a_value_is_a_series_over_the_clock_of_the_records",
    ),
    "`mauve report DIR` draws up to 24 values as curves.": (
        f"{_REPORT}_values.py::test_curves_of_resources_come_first_and_the_note_names_those_left_out",
        f"{_REPORT}_values_browser.py::test_curves_gaps_and_marks_are_drawn",
    ),
    "The curves share axis, zoom and cursor with the timeline.": (
        f"{_REPORT}_values_browser.py::test_the_plots_have_the_same_width",
        f"{_REPORT}_values_browser.py::test_zoom_is_common",
        f"{_REPORT}_values_browser.py::test_the_cursor_is_common",
    ),
    "The page also lists the values before, during and after each reconfiguration.": (
        f"{_REPORT}_values.py::test_a_swap_reports_before_after_and_step",
        f"{_REPORT}_values.py::test_a_swap_reports_values_during_the_blackout_and_where_there_is_none",
    ),
    "`mauve trace export DIR` writes a counter for each value.": (
        "python/trace/test_perfetto.py::test_each_value_is_a_counter_of_a_group_of_their_own",
        "python/cli/test_trace_export.py::test_values_of_a_bag_are_counters",
    ),
    "`mauve trace export DIR --format csv` writes the same values for a spreadsheet:": (
        "python/cli/test_trace_export.py::test_perfetto_is_the_default",
        "python/cli/test_trace_export.py::test_csv",
    ),
    "From Python, also of a bag that is being written, and of one that needs repair": (
        "python/project/test_readme_examples.py::test_the_python_example_reads_a_bag",
        "python/trace/test_reader.py::test_a_bag_cut_off_anywhere_gives_what_is_whole",
    ),
    # ---- look at a run
    "mauve report DIR # writes DIR/report.html; --out FILE.html, --title T": (
        "python/trace/report/test_page.py::test_the_command_writes_into_the_bag_unless_told_otherwise",
    ),
    "mauve report bag --out run.html # a folder of bags, or several: one run, on one timeline": (
        "python/trace/report/test_page.py::test_bags_are_named_by_what_tells_them_apart",
    ),
    "One page that needs no network and no server": (
        "python/trace/report/test_page.py::test_a_page_needs_nothing_but_itself",
    ),
    (
        "It begins with a yes or a no to whether the timing held, why, and the figures to "
        "remember; moments at which the machine stalled are told apart from what the components "
        "did."
    ): (
        "python/trace/report/test_page.py::test_the_verdict_comes_first_then_the_tiles_then_the_rest",
        f"{_REPORT}_verdict.py::test_overruns_that_a_stall_brought_about_are_told_apart_from_those_of_a_component",
    ),
    (
        "Behind it: a timeline to zoom from minutes to microseconds, with states, releases, "
        "overruns, faults and reconfigurations; reconfigurations before, during and after; "
        "histograms of wake-up latency, response and execution times; the architecture with its "
        "loads; tables."
    ): (
        f"{_REPORT}_browser.py::test_a_view_goes_down_to_single_microseconds_and_no_further_than_the_trace",
        "python/trace/report/test_browser.py::test_the_page_works_and_nobody_complains",
    ),
    "Of long traces it keeps every detail around what is interesting and merges the rest, and says so.": (
        "python/trace/report/test_data.py::test_the_neighbourhood_of_what_is_interesting_stays_whole",
        "python/trace/report/test_browser.py::test_what_is_merged_says_so",
    ),
    '`mauve_rt.trace.report.write_report(Path("report.html"), mauve_rt.trace.open("DIR"))`.': (
        "python/project/test_readme_examples.py::test_the_report_is_written_from_python",
    ),
    # ---- compare two runs
    (
        "mauve report A B --compare # writes A/comparison.html and prints the tables; --json, --out FILE.html"
    ): (
        f"{_REPORT}_compare.py::test_the_page_is_in_the_first_folder_unless_told_otherwise",
        f"{_REPORT}_compare.py::test_the_command_compares_a_bag_with_itself",
    ),
    "A and B are each one run: a bag or a folder of bags.": (
        f"{_REPORT}_compare.py::test_a_run_may_be_a_folder_of_bags",
    ),
    (
        "The page and the tables show the timing of each component, the decisions of rules, the "
        "reconfigurations and the values of topics in both runs, and list everything that only one run has."
    ): (
        f"{_REPORT}_compare.py::test_terminal_and_page_agree",
        f"{_REPORT}_compare.py::test_a_rule_that_acted_only_in_b_is_listed",
        f"{_REPORT}_compare.py::test_components_and_states_of_one_run_are_listed",
    ),
    (
        'The mark "larger than noise" stands where two conditions hold: the whole interval of the '
        'difference excludes "no change", and the difference exceeds the difference between the two '
        "halves of either run."
    ): (
        f"{_REPORT}_compare_noise.py::test_more_tested_figures_widen_the_interval",
        f"{_REPORT}_compare_noise.py::test_a_change_within_the_halves_of_a_run_is_no_difference",
    ),
    (
        "The intervals come from resampled blocks of consecutive releases, because releases that follow each "
        "other are alike."
    ): (f"{_REPORT}_compare_noise.py::test_correlation_widens_the_interval",),
    "They hold at 95 % for all figures of the page together.": (
        f"{_REPORT}_compare_noise.py::test_more_tested_figures_widen_the_interval",
    ),
    "Of 100 pages about equal runs, at most about 5 have a mark.": (
        f"{_REPORT}_compare.py::test_equal_runs_are_marked_on_few_pages",
    ),
    (
        "A run of fewer than 500 releases that lasts less than 10 s is too short to tell, and a p99 needs "
        "1,000 values."
    ): (
        f"{_REPORT}_compare_noise.py::test_a_run_is_cut_into_blocks_of_enough_values_or_long_enough",
        f"{_REPORT}_compare_noise.py::test_the_percentile_of_a_run_is_exact_and_that_of_few_values_is_not_told",
    ),
    "A maximum is a single value and has no mark.": (f"{_REPORT}_compare.py::test_a_maximum_has_no_mark",),
    "A burst of overruns counts as one.": (f"{_REPORT}_compare.py::test_a_burst_of_overruns_counts_as_one",),
    "In simulated time the page also shows the largest difference at equal instants.": (
        f"{_REPORT}_compare.py::test_in_simulated_time_a_single_sample_that_differs_is_told",
    ),
    (
        "The noise is measured within each run: another load of the computer during one of the runs is a "
        "difference, too."
    ): (f"{_REPORT}_compare.py::test_another_load_is_a_difference",),
    # ---- concepts: components and time
    "all replaceable parts (`package/Class`)": (
        "Rule9Parts.AllThreePartsAndAnotherTwoBack",
        "python/control/test_control.py::test_all_parts_are_replaced_as_one",
    ),
    "An fsm has *execution* states, which take no logical time, and *wait* states.": (
        "Rule1Clock.AChainOfExecutionsRunsWithinOneInstantHoweverLongItTakes",
    ),
    "Only wait states advance the component's **logical clock**": (
        "Rule1Clock.AChainOfExecutionsRunsWithinOneInstantHoweverLongItTakes",
    ),
    "`wait(d)` adds d to the clock and sleeps until the real clock reaches it": (
        "Rule1Clock.EachWaitAdvancesItByItsLength",
    ),
    "Instants are absolute, so nothing drifts, however long execution takes.": (
        "Rule2Instants.DoNotDriftOverTenThousandPeriodsWhateverExecutionTakes",
    ),
    "The component's **period** is the greatest common divisor of its fsm's cycles.": (
        "Rule3Period.IsTheGcdOfAllCyclesOfAnyMachine",
        "Rule3Grid.InitialStatesInstantsAreEpochAndOffsetAndMultiplesOfThePeriod",
    ),
    "Its **grid** is `epoch + offset + k * period`": (
        "Rule3Period.IsTheGcdOfAllCyclesOfAnyMachine",
        "Rule3Grid.InitialStatesInstantsAreEpochAndOffsetAndMultiplesOfThePeriod",
    ),
    "The architecture refuses an fsm with a loop without a wait": (
        "Rule1Loops.ALoopWithoutAWaitIsRefusedByName",
    ),
    "a write to the resource that one of its ports reads": ("Rule12Events.EveryKindOfResourceRaisesThem",),
    "| `event` | a count of events, for `wait_event` |": ("Rule12Events.EveryKindOfResourceRaisesThem",),
    "`wait_event(port, timeout, min_interarrival)`": ("Rule12Events.AreKeptApartByTheMinimalInterarrival",),
    "The clock is then set to the time of the event": ("Rule12Events.ReleaseAtTheEventsTimeOrAtTheTimeout",),
    "Such a component is *sporadic*: it has no period.": ("Rule12Events.AreNoPeriodNorPhase",),
    # ---- concepts: resources
    (
        "| `shared_data` | the newest value of any number of writers, for readers that neither block "
        "nor fail |"
    ): (
        "LatestValueStress.ReadersSeeWholeValuesInOrder",
        "SharedData.TakesReadersWhileItIsInUse",
        "bench:  B, against a hammering ",
    ),
    "| `ring_buffer` | a queue; each element goes to one reader |": (
        "RingFixture.EachElementGoesToOneReaderAndAFullRingRefuses",
    ),
    (
        "| `latest_value` | the newest value of one writer, of a type without dynamic members; "
        "`max_readers` is known from the start |"
    ): (
        "LatestValue.TakesOneWriter",
        "LatestValue.OfATypeThatCannotBeCopiedAsBytesIsRefused",
        "LatestValue.TakesAsManyReadersAsDeclared",
        "LatestValue.AWriterNeverWaitsForReadersThatKeepOldValues",
        "bench: : reads that failed or found halves of two values",
    ),
    (
        "**A port that is alone never waits**: the only port that writes to one of these three kinds, "
        "and the only port that reads a `ring_buffer` without `overwrite`."
    ): (
        "Ring.HasALockWithTwoPortsAtAnEnd",
        "SharedData.ALockIsForWritersAmongThemselves",
        "BiasedMutex.AThreadHoldsNoLockWhileItHasTheBias",
        "python/project/test_loom_models.py::test_each_model_holds_and_each_weakened_twin_fails",
    ),
    ("Two ports at such an end, or a port and an incoming topic, have a mutex with priority inheritance."): (
        "Ring.HasALockWithTwoPortsAtAnEnd",
        "PriorityInheritance.TheHighestIsServedBeforeTheMiddle",
        "bench: FIFO90 blocked by a 2 ms holder while a FIFO50 hog burns 50 ms, through SharedData, worst",
    ),
    (
        "A transaction that adds or removes a port exchanges the one for the other while both ends are in "
        "use, and loses no element."
    ): (
        "RingFixture.NoElementIsLostOrGivenTwiceWhilePortsComeAndGo",
        "RingTransactions.GiveEveryElementOnceWhileAReaderComesAndGoes",
    ),
    "`goals.write (lock)`.": ("python/cli/test_list_view.py::test_a_port_that_takes_a_lock_is_marked",),
    "`mauve list` marks a port that takes the mutex:": (
        "python/cli/test_list_view.py::test_a_port_that_takes_a_lock_is_marked",
        "python/bindings/test_kernel.py::test_a_second_writer_of_a_ring_gives_it_a_lock",
    ),
    "A type that only Python knows always has the mutex.": (
        "python/bindings/test_kernel.py::test_a_type_that_only_python_knows_has_a_lock",
    ),
    "| your own | such as the mission's map with `get` and `update`, which take a callable |": (
        "UserResource.IsReachedByCallablesAndTellsListeners",
    ),
    "A read yields the value, whether it is old or new to this port, and the time of its writer.": (
        "KeepingResources.StatusIsPerPort",
        "PortsFixture.WritersTimeIsTheLogicalClockOrTheRealOne",
    ),
    "Kind and type have to be equal": ("PortsFixture.UnequalKindsAndTypesAreRefused",),
    "A resource can be **bound to a ROS topic**, of any installed message type.": (
        "ros/bridge/test_topics.py::test_a_type_nobody_registered_is_received_and_written",
    ),
    "The messages travel in C++, the interpreter has no part in them": (
        "ros/executor/test_rules.py::test_acts_while_a_component_in_python_keeps_the_interpreter",
        "bench: CPU of an executor that sends ",
        "bench: wake-up latency of a 1 kHz component in the executor, rclpy busy",
    ),
    "Names are relative to the executor's namespace": (
        "ros/cli/test_list.py::test_resources_have_the_names_that_ros_sees",
    ),
    "Quality of service is a profile's name or fields of your own": (
        "ros/bridge/test_topics.py::test_qualities_of_service_by_field_are_those_of_the_topic",
        "ros/executor/test_qos_warnings.py::test_a_deadline_that_nobody_promises_is_logged_and_matches_nobody",
        "python/model/test_qos_remarks.py::test_a_remark_wherever_an_ordinary_publisher_would_not_be_heard",
    ),
    (
        "A kind of your own declares its parameters with range and unit; a file sets and checks "
        "them as a `ring_buffer`'s `capacity`."
    ): (
        "python/model/test_resource_kinds.py::test_a_parameter_of_a_plugin_is_set_by_the_file",
        "python/model/test_resource_kinds.py::test_a_bad_parameter_is_refused_at_its_place",
    ),
    "an event is a `std_msgs/msg/Empty` or a true `Bool`": (
        "ros/bridge/test_topics.py::test_an_event_is_an_empty_message_or_a_true_one",
    ),
    (
        "`/diagnostics` counts received and sent messages, refused messages (a full ring, a "
        "message larger than `max_bytes`) and missed deadlines, and"
    ): (
        "ros/bridge/test_topics.py::test_a_message_that_is_too_large_is_refused_and_counted",
        "ros/bridge/test_topics.py::test_missed_deadlines_are_counted",
    ),
    "says when another node's type or quality of service does not fit:": (
        "ros/bridge/test_topics.py::test_another_type_that_comes_to_the_topic_is_told",
        "ros/bridge/test_topics.py::test_a_quality_of_service_that_does_not_fit_is_told",
    ),
    "One thread sends all messages: real-time, at the lowest priority, on any CPU.": (
        "ros/bridge/test_topics.py::test_messages_are_sent_where_and_as_urgently_as_the_file_says",
    ),
    (
        "If a message must not wait for other components' work or for another CPU to wake up, "
        "give the thread a priority and the CPU of the component:"
    ): (
        "ros/bridge/test_topics.py::test_messages_are_sent_where_and_as_urgently_as_the_file_says",
        "bench: the same, sent on the component's CPU, p",
    ),
    (
        "**ROS services** work in both directions: a resource `client` calls a service, and a "
        "resource of your own can offer one of its calls as a service."
    ): (
        "ros/bridge/test_calls.py::test_a_component_calls_a_ros_service_and_never_waits_longer_than_declared",
        "ros/bridge/test_calls.py::test_a_resources_call_is_a_ros_service",
    ),
    "A component's call never blocks longer than `timeout_ms`,": (
        "ClientCall.TimesOutAndIsNotAnsweredByALateReply",
    ),
    "and a stop of the component ends it at once:": ("CallingComponent.StopsInTheMiddleOfACall",),
    "Bounded members keep it free of allocation": ("CallingComponent.IsAnsweredWithoutAllocation",),
    "A transaction may add bound resources as well; removing a resource removes its binding.": (
        "ros/bridge/test_calls.py::test_topics_and_services_come_and_go_while_all_runs",
    ),
    # ---- concepts: deployment and change
    "It meets all of them at a barrier, and only then publishes one epoch": (
        "Rule5Deployment.AllComponentsShareOneEpochPublishedAfterAllAreReady",
        "HygieneOfTheKernel.NoPageFaultAfterTheStart",
        "system/test_figures.py::test_with_it_both_are_on_one_grid",
    ),
    "Each component runs from its first instant after the epoch on": (
        "Rule5Deployment.AllComponentsShareOneEpochPublishedAfterAllAreReady",
        "HygieneOfTheKernel.NoPageFaultAfterTheStart",
        "system/test_figures.py::test_with_it_both_are_on_one_grid",
    ),
    "`stop` interrupts a wait at once": ("Rule6Threads.AStopNeverWaitsOutAPeriod",),
    "`start` enters at the next instant of the grid, so nothing shifts, however long the stop lasted.": (
        "Rule6Simulated.StartsAtTheFirstInstantLaterThanTheMargin",
        "Rule6StopStart.StopAtRandomPhasesNeverLosesItsWakeUpAndRestartsOnTheGrid",
    ),
    "`start(clock)` with a clock in the future enters at that clock": (
        "Rule6Simulated.StartsAtTheFirstInstantLaterThanTheMargin",
        "Rule6StopStart.StopAtRandomPhasesNeverLosesItsWakeUpAndRestartsOnTheGrid",
    ),
    "[figures.md](../figures.md) has the paper's Fig. 3, 5 and 6 drawn from traces.": (
        "system/test_figures.py::test_the_drawings_are_whole",
    ),
    "SCHED_FIFO, own priority, pinned, its whole declared stack (512 KiB unless declared) in memory.": (
        "Prefaulted.TheWholeDeclaredStackIsInMemory",
    ),
    "The **deployer** turns each component into a thread": ("Prefaulted.TheWholeDeclaredStackIsInMemory",),
    (
        "Memory that parts allocated in their constructors and in `configure` is put into memory "
        "before they run, at the deployment and at every replacement."
    ): (
        "Prefaulted.WhatANewCoreAllocatedIsInMemory",
        "Prefaulted.WhatTheFirstCoreAllocatedIsInMemory",
    ),
    "This holds for memory that they have not touched yet, too": (
        "Prefaulted.WhatANewCoreAllocatedIsInMemory",
        "Prefaulted.WhatTheFirstCoreAllocatedIsInMemory",
    ),
    "**Replacing** a core, an fsm or a shell is prepare, commit, retire.": (
        "python/parts/test_cores.py::test_its_hooks_run_on_ordinary_threads_its_actions_on_the_component_s",
        "python/parts/test_components.py::test_replaced_cores_are_let_go",
    ),
    (
        "**Prepare.** The new part is built, bound and configured on an ordinary thread while the "
        "old one runs."
    ): ("python/parts/test_cores.py::test_its_hooks_run_on_ordinary_threads_its_actions_on_the_component_s",),
    "**Commit.** The commit happens on the component's own thread, inside a wait.": (
        "Rule9Replace.KeepsThePendingInstantAndMissesNothing",
    ),
    "The component goes on waiting for the instant that was pending all along": (
        "Rule9Replace.KeepsThePendingInstantAndMissesNothing",
    ),
    "The new part's `adopt` may refuse; then everything goes on as before.": (
        "Rule9Replace.RefusalsLeaveTheOldCoreRunning",
    ),
    "Its `take` moves the state over and cannot fail": ("Rule9Replace.RefusalsLeaveTheOldCoreRunning",),
    "So a replaced core misses no release": (
        "Rule9Replace.AThousandTimesAtRandomPhasesMissesNoRelease",
        "Rule9Parts.ACoreKeepsThePositionAndThePendingInstant",
        "bench: , releases missed",
    ),
    "and no other component is touched": (
        "Rule10Random.TransactionsDoWhatTheModelSaysOrNothing",
        "bench: , releases missed by ",
    ),
    "**Retire.** An ordinary thread cleans up the old part": (
        "python/parts/test_cores.py::test_its_hooks_run_on_ordinary_threads_its_actions_on_the_component_s",
        "python/parts/test_components.py::test_replaced_cores_are_let_go",
    ),
    "It creates the threads": ("Rule5Deployment.ThreadsAreWhatWasAskedFor",),
    "| has a wait of the same name, and the pending instant lies on its grid | in this wait |": (
        "Rule7Restart.AnFsmThatHasTheWaitGoesOnInItsPlace",
        "Rule7Restart.NoReleaseOfAnFsmWithSeveralWaitsIsLostInAnySwap",
        "Rule7RestartOnThreads.AnFsmWithSeveralWaitsKeepsItsPlace",
    ),
    "A new shell brings another instance of the fsm": ("SporadicChanges.AnotherShellLosesNoEventEither",),
    "| has its initial state on the pending instant | in its initial state at the pending instant,": (
        "Rule7Simulated.ANewFsmStartsInItsInitialStateOnItsOwnPeriod",
        "Rule9Parts.AnFsmStartsInItsInitialStateOnItsOwnPeriodAndTheSameEpoch",
    ),
    "A transition may carry a guard": ("ComponentLife.AWaitsGuardIsAskedWhenTheWaitHasEnded",),
    "The guard of a wait is evaluated when the wait has ended": (
        "ComponentLife.AWaitsGuardIsAskedWhenTheWaitHasEnded",
    ),
    "`wait(kForever)` lasts until the component is stopped": ("ComponentLife.AWaitForEverLastsUntilTheStop",),
    "A state may stop its own component: the stop takes effect when the state ends.": (
        "ComponentLife.AStateMayStopItsOwnComponent",
    ),
    "`resynchronise` gives all components a new common epoch": (
        "Resynchronise.AllGoOnOnTheGridsOfTheNewEpoch",
        "ResynchroniseInVirtualTime.MovesEachInstantToTheFirstOfTheNewGrid",
    ),
    (
        "All instants of a component move by the same time, less than a period, so that they lie "
        "on the new grid."
    ): (
        "Resynchronise.AllGoOnOnTheGridsOfTheNewEpoch",
        "ResynchroniseInVirtualTime.MovesEachInstantToTheFirstOfTheNewGrid",
    ),
    "so that it misses no release either |": (
        "Rule7Restart.ThePendingInstantIsTakenWhenItIsOnTheNewGrid",
        "Rule7RestartOnThreads.NoReleaseIsMissedOnAnEqualGrid",
    ),
    (
        "| has neither | in its initial state at the first later instant of its own grid; the "
        "report says how many releases of the old grid that cost, and why |"
    ): ("Rule7Restart.ElseTheFirstOfTheNewGridAndTheReportSaysWhatThatCost",),
    "New parts are configured with the properties and the wiring that their own transaction makes": (
        "PreparedFuture.ACoreSeesWhatStepsBeforeAndAfterItMake",
        "PreparedFuture.AnFsmSeesThemInDefine",
        "PreparedFuture.AShellSeesItsOwnFuture",
    ),
    "Values that new parts write before the commit are dropped": (
        "PreparedFuture.WhatIsWrittenInPreparationGoesNowhere",
    ),
    "The time between the thread's `parked` and `armed` records is the **blackout**": (
        "python/trace/test_kernel.py::test_swaps_are_as_the_kernel_reported_them",
    ),
    (
        "A **transaction** is any number of steps - replace core, fsm or shell, set properties, "
        "connect, disconnect, add, remove, start, stop, configure, resynchronise - that take "
        "effect together or not at all."
    ): (
        "Rule10Random.TransactionsDoWhatTheModelSaysOrNothing",
        "Rule10Transaction.CoresAndPropertiesOfTwoComponentsChangeAtOnce",
        "bench: : architectures other than described",
    ),
    "Each component agrees on its own thread, in a wait of its own, and runs on with its old parts.": (
        "Rule10Transaction.WiresAreSwappedBetweenTwoRunningComponents",
        "Rule10Commit.WhileAnAdoptLastsTheOthersGoOn",
    ),
    "All steps are prepared": (
        "Rule10Transaction.WiresAreSwappedBetweenTwoRunningComponents",
        "Rule10Commit.WhileAnAdoptLastsTheOthersGoOn",
    ),
    "With the last agreement the change has one logical instant T": (
        "Cut.InstantIsTheClockAfterTheFrontier",
        "ChangeModel.HoldsInEveryInterleaving",
    ),
    "Each component takes its change in its wait, at its first release at or after T": (
        "Cut.InstantIsTheClockAfterTheFrontier",
        "ChangeModel.HoldsInEveryInterleaving",
    ),
    "No component waits for another one, so none misses a release for it": (
        "Rule7Threads.WhoWaitsForALongExecutionOfAnotherMissesNoRelease",
        "ros/executor/test_stop_wins.py::test_no_component_waits_for_one_that_still_executes",
    ),
    (
        "A component that reaches no wait prevents the change: the commit time-out (`--timeout`) "
        "refuses the transaction."
    ): ("Rule10Failure.ATransactionThatCannotGatherAllIsWithdrawnAndSaysWhoStillRuns",),
    "A stop, a fault or a shutdown before T is fixed calls the commit off and waits for no component": (
        "Rule10Commit.AStopCallsACommitOffAndWaitsForNobody",
        "Rule10Commit.AFaultCallsTheCommitOff",
        "ros/executor/test_stop_wins.py::test_the_end_waits_for_no_change",
    ),
    "A component that is late at T takes its change at the end of its overrun": (
        "ChangeModel.HoldsInEveryInterleaving",
        "Rule10Commit.ALateOneTakesTheChangeAtTheEndOfItsState",
    ),
    "Until then the late component runs old parts while others already run new parts": (
        "ChangeModel.HoldsInEveryInterleaving",
        "Rule10Commit.ALateOneTakesTheChangeAtTheEndOfItsState",
    ),
    "The report gives T, and when the first release of each component with the change was due and came": (
        "ChangeInstant.IsTheSameForAllComponentsAndSplitsNoneOfThem",
        "ChangeInstantOnThreads.IsKnownOfALateComponentBeforeItTakesTheChange",
        "python/cli/test_verbs.py::test_the_next_release_in_words",
    ),
    "`mauve trace check` finds each change in a bag of which a release ran on the wrong side of T": (
        "python/trace/test_split_changes.py::test_a_release_before_t_after_the_take_is_wrong",
        "python/trace/test_split_changes.py::test_a_release_at_or_after_t_before_the_take_is_wrong",
    ),
    "Values that a late component writes to a resource whose writer has changed are dropped.": (
        "WeakenedChangeModel.Breaks",
        "Rule10Floor.WhatALateOneWritesToAnEndThatHasMovedIsDropped",
    ),
    (
        "If the meaning of a resource changes (unit, frame), bring a new resource in the "
        "transaction and rewire both ends."
    ): ("Rule10Transaction.AnotherChainIsAddedAndWiredInAndTheOldOneRemoved",),
    (
        "An `adopt` that takes longer refuses the change; after a longer `adopt` and `take` "
        "together the component is `FAULTED`."
    ): (
        "Rule10Commit.AnAdoptOverItsDeclaredBudgetIsRefused",
        "Rule10Commit.ATakeOverItsDeclaredBudgetIsInAndFaultsItsComponent",
    ),
    "A core may declare the time that `adopt` and `take` need together (`budget_ns`).": (
        "Rule10Commit.AnAdoptOverItsDeclaredBudgetIsRefused",
        "Rule10Commit.ATakeOverItsDeclaredBudgetIsInAndFaultsItsComponent",
    ),
    "Where no budget is declared, none is checked": ("Rule10Commit.WhoIsOverItsBudgetIsNamedAndNobodyElse",),
    "A failure at any step leaves the architecture as it was, and the error names the step.": (
        "Rule10Failure.AtEveryStepAndOfEveryKindLeavesAllAsItWas",
        "python/control/test_control.py::test_a_refusal_names_the_step_and_changes_nothing",
    ),
    "An **exception** in a component parks it `FAULTED`, its outputs safe; all others run on.": (
        "Rule11Faults.AnExceptionParksItsComponentAndWritesItsOutputs",
        "ros/executor/test_process.py::test_fault_is_told_at_once_and_the_others_run_on",
    ),
    "A state that runs longer faults its component when it ends": (
        "Rule11Watchdog.AnExecutionOverItsBoundIsAlwaysFoundAtItsEnd",
    ),
    "A state may declare a bound (`max_execution`)": (
        "Rule11Watchdog.AnExecutionOverItsBoundIsAlwaysFoundAtItsEnd",
    ),
    "While the state still runs, a real-time watchdog does the same:": (
        "Rule11Faults.AStateOverItsDeclaredTimeIsCaughtByTheWatchdog",
    ),
    (
        "the watchdog sleeps until the next bound can be exceeded, marks the component `FAULTED`, "
        "takes away the priority of its thread, then writes its outputs."
    ): ("Rule11Watchdog.SleepsForEverWhereNobodyDeclaresABound",),
    "The watchdog waits for no lock": ("Rule11Watchdog.WaitsForNoLockThatTheTimedOutOneHolds",),
    "| is `FAULTED` | repaired in place by a step `configure` or `replace_core`, then started |": (
        "Rule11Repaired.AndStartedInOneTransaction",
        "Rule11Repaired.ByConfiguringItAnew",
    ),
    ("| is `FAULTED`, and its thread does not come back | is removed and added anew, in one transaction |"): (
        "Rule11Watchdog.ATimedOutComponentIsReplacedWhileItsThreadRuns",
    ),
    (
        "| declares a core `fallback` | the component's own thread puts the fallback core in and "
        "goes on at the next instant of its grid |"
    ): (
        "Rule11FallbackThreads.IsPutInByTheComponentsOwnThread",
        "Rule11Fallback.StartsInTheInitialStateAtTheNextInstantOfTheGrid",
    ),
    "Equal architectures, callbacks and seeds give equal traces, bit for bit": (
        "Rule13SimulationSeeds.EqualSeedsGiveEqualTracesBitForBit",
        "python/bindings/test_simulation.py::test_two_runs_leave_the_same_trace_byte_by_byte",
    ),
    "Basic elements (`mauve_rt/kernel/elements/`) are parts that many robots need": (
        "Elements.AFilterIsOneMethod",
        "ElementsHygiene.NoAllocationOnAComponentThread",
    ),
    "| relay | copies its input to its output |": (
        "Elements.AFilterIsOneMethod",
        "ElementsHygiene.NoAllocationOnAComponentThread",
    ),
    "| `PeriodicFsm` | the paper's periodic state machine |": (
        "Elements.AFilterIsOneMethod",
        "ElementsHygiene.NoAllocationOnAComponentThread",
    ),
    "| shells for sources, filters and sinks | shells with which a component is one method `update()` |": (
        "Elements.AFilterIsOneMethod",
        "python/parts/test_elements.py::test_a_core_in_python_needs_but_one_method",
    ),
    "| multiplexer | passes one of its inputs; a property switches it while it runs |": (
        "Elements.AMultiplexerPassesTheInputThatIsSelectedInFlight",
    ),
    (
        "| priority multiplexer | passes the first input that is fresh, such as the joystick "
        "before the autonomous driver |"
    ): (
        "Elements.APriorityMultiplexerPassesTheFirstThatIsFresh",
        "python/parts/test_elements.py::test_a_person_s_command_goes_before_the_robot_s",
    ),
    "`mauve_rt/TwistPriorityMultiplexer`": (
        "python/parts/test_elements.py::test_what_is_listed_is_what_is_registered",
    ),
    (
        "*when* a condition holds, *do* this transaction, and *undo* it when the condition has "
        "been false for long enough."
    ): (
        "ros/supervisor/test_node.py::test_a_silent_peer_leads_to_the_swap_and_its_return_to_the_swap_back",
        "python/supervision/test_remote_rules.py::test_a_lost_link_is_acted_on_and_undone_when_it_has_been_back_long_enough",
    ),
    "**Traces** are fixed-size records that component threads put into wait-free rings.": (
        "TraceRing.LosesNothingBetweenTwoThreads",
        "bench: trace record, on",
    ),
    (
        "A native thread below all components empties the rings, and another one writes the "
        "records into the bag: neither the disk nor the interpreter is in the way of a component."
    ): (
        "TraceCollectorTest.NothingIsLostWhileNobodyTakes",
        "HygieneOfTheKernel.NoAllocationAfterTheStart",
    ),
    (
        "For [ui.perfetto.dev](https://ui.perfetto.dev) traces become a track per component, with "
        "states as slices and reconfigurations as flows from the request to the next release."
    ): (
        "python/trace/test_perfetto.py::test_one_process_and_its_components",
        "python/trace/test_perfetto.py::test_a_reconfiguration_flows_from_the_request_to_the_next_release",
    ),
    "mauve analyze robot.yaml # of a file": (
        "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
    ),
    "mauve analyze robot.yaml --witness DIR": (
        "python/cli/test_analyze.py::test_what_is_not_says_who_misses_when_and_why_and_shows_it",
    ),
    "mauve analyze robot.yaml --suppose guidance.Planning=120ms": (
        "python/cli/test_analyze.py::test_what_would_be_if_a_state_took_longer",
        "python/test_schedulability.py::test_a_slow_planner_takes_the_time_of_those_below",
    ),
    "[Is my robot schedulable?](../howto/is_my_robot_schedulable.md) shows the steps": (
        "python/cli/test_analyze_pages.py::test_the_commands_of_the_how_to_print_what_it_shows",
    ),
    "The mission's robot is schedulable by its declared times": (
        "python/test_schedulability.py::test_the_robot_is_schedulable",
    ),
    "`schedulable` (exit status 0) is a proof under the conditions that stand below it": (
        "python/cli/test_analyze.py::test_what_is_schedulable_is_so_under_conditions",
        "python/analysis/test_verdict.py::test_no_miss_is_found_where_the_bounds_are_met",
        "python/analysis/test_digraph_times.py::test_no_run_is_above_its_bound",
    ),
    "`not schedulable` (1) says who misses which deadline through whom, and has a run that shows it": (
        "python/cli/test_analyze.py::test_what_is_not_says_who_misses_when_and_why_and_shows_it",
        "python/analysis/test_verdict.py::test_runs_are_those_of_the_other_simulation",
    ),
    "else nothing is proved (3), and it says what to declare": (
        "python/cli/test_analyze.py::test_the_model_in_words",
        "python/analysis/test_verdict.py::test_an_offset_that_prevents_the_miss_leaves_it_not_proved",
    ),
    "path by path through the fsms": (
        "python/analysis/test_digraph_times.py::test_never_more_than_as_a_sporadic_task",
        "python/analysis/test_digraph_times.py::test_the_bounds_are_within_5_percent_of_exact_for_95_percent",
    ),
    "mauve analyze robot.yaml --budget-from DIR --margin 1.2": (
        "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
    ),
    "mauve analyze robot.yaml --budget-from DIR --write": (
        "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
        "python/yaml/test_insertion.py::test_an_entry_is_put_in_and_all_else_stays",
    ),
    "It shows the model that runs as a timing analysis takes it": (
        "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
        "python/cli/test_analyze.py::test_the_model_in_words",
    ),
    "A job is what is executed from one wait to the next by the costliest way through the fsm": (
        "python/analysis/test_digraph.py::test_of_several_ways_to_a_wait_the_costliest_counts",
        "python/analysis/test_digraph.py::test_no_run_of_any_machine_is_outside_of_its_digraph",
    ),
    "Where all that may delay a component is known, it says a bound of its response time": (
        "python/analysis/test_bounds.py::test_where_one_that_may_delay_it_is_unknown_there_is_no_bound",
        "python/analysis/test_bounds.py::test_those_of_higher_priority_delay_those_below_and_not_the_reverse",
        "python/cli/test_analyze.py::test_the_model_in_words",
    ),
    "by busy windows under fixed priorities, FIFO among equals": (
        "python/analysis/test_oracle.py::test_fixed_priority_with_jitter_and_blocking",
        "python/analysis/test_simulation.py::test_no_response_time_exceeds_its_bound",
    ),
    "Times are *declared*, *measured* or *missing*": (
        "ros/cli/test_analyze.py::test_a_file_a_node_and_a_bag_tell_one_model",
        "python/cli/test_analyze.py::test_the_model_in_words",
    ),
    "The worst-case execution time of a state is `wcet_ns`: the analysis takes it, and nothing enforces it": (
        "python/cli/test_analyze.py::test_a_worst_case_comes_before_the_bound_that_is_enforced",
        "DeclaredStates.NothingEnforcesTheWorstCase",
        "DeclaredStates.WorstCaseTakesNoVirtualTime",
    ),
    "For a state without `wcet_ns` the analysis takes `max_execution_ns`, the bound that the": (
        "python/analysis/test_machines.py::test_the_worst_case_comes_before_the_bound",
        "DeclaredStates.BoundFaultsWhatLastsLonger",
    ),
    "the component then blocks those of higher priority on its CPU, and nothing enforces this time": (
        "python/analysis/test_bounds.py::test_one_below_that_holds_a_lock_blocks_those_up_to_the_highest_user",
        "python/analysis/test_digraph_times.py::test_no_run_is_above_its_bound",
        "python/cli/test_analyze.py::test_a_lock_that_is_held_blocks_and_is_shown",
        "Deployed.NothingEnforcesTheLongestHold",
    ),
    "What cannot be proved of a component is said, with the remedy": (
        "python/cli/test_analyze.py::test_what_cannot_be_proved_is_said_of_each_component",
    ),
    "Times and deadlines stand in the code of an fsm or in the architecture file": (
        "python/cli/test_analyze.py::test_a_declared_time_of_the_file_or_of_the_code",
        "DeclaredStates.StandInThePlaceOfTheFsmsOwn",
    ),
    (
        "`mauve check FILE...` reports errors in architecture, rules and steps files, with line "
        "and column, without starting anything."
    ): (
        "python/cli/test_check.py::test_an_architecture_file",
        "python/cli/test_check.py::test_a_rules_file_by_itself",
        "python/cli/test_check.py::test_a_steps_file_by_itself",
    ),
    "Given an architecture file as well, it tries rules and steps on it": (
        "python/cli/test_check.py::test_steps_beside_an_architecture_are_tried_on_it",
        "python/cli/test_check.py::test_rules_beside_an_architecture_do_and_undo",
    ),
    (
        "It warns of a subscription that ordinary publishers will not match, such as one with a "
        "`deadline_ms`."
    ): ("python/cli/test_check.py::test_a_subscription_that_no_ordinary_publisher_matches_is_a_warning",),
    # ---- failures that users of other frameworks reported
    (
        "**Here** the thread that asks for a change configures the new part, and later cleans up the "
        "old part."
    ): (f"{_PEERS}a_loop_runs_on_while_a_new_part_takes_long_to_come_and_an_old_one_to_go",),
    "The component runs on during both.": (
        f"{_PEERS}a_loop_runs_on_while_a_new_part_takes_long_to_come_and_an_old_one_to_go",
    ),
    (
        "Its own thread only puts the new part in, inside a wait, and the component misses no release for it."
    ): (
        f"{_PEERS}a_loop_runs_on_while_a_new_part_takes_long_to_come_and_an_old_one_to_go",
        "Rule9Replace.AThousandTimesAtRandomPhasesMissesNoRelease",
    ),
    "**Here** a list is a snapshot, which the thread of the caller takes.": (
        f"{_PEERS}a_loop_does_not_wait_for_those_who_list_it_nor_they_for_the_loop",
    ),
    "A list does not wait for a component, not even for one that executes.": (
        f"{_PEERS}a_loop_does_not_wait_for_those_who_list_it_nor_they_for_the_loop",
    ),
    "Lists hold no lock that a component waits for.": (
        f"{_PEERS}a_loop_does_not_wait_for_those_who_list_it_nor_they_for_the_loop",
    ),
    "The mechanism is one thread for each component: see": ("Rule5Deployment.ThreadsAreWhatWasAskedFor",),
    "**Here** one transaction changes a chain.": (
        f"{_PEERS}a_chain_of_which_one_part_fails_is_not_changed_at_all",
    ),
    (
        "If one part refuses, the error names the step, and no component changes: the old chain runs "
        "on with its old references."
    ): (f"{_PEERS}a_chain_of_which_one_part_fails_is_not_changed_at_all",),
    "The mechanism is that all components agree before the first one changes: see": (
        f"{_PEERS}a_chain_of_which_one_part_fails_is_not_changed_at_all",
    ),
    (
        "**Here** the kernel writes the output that the shell of the failed component declares for "
        "this case, zero unless declared otherwise."
    ): (f"{_PEERS_FAULTS}after_a_fault_those_behind_read_the_declared_output_and_run_on",),
    "The next component reads this value at once, and runs on.": (
        f"{_PEERS_FAULTS}after_a_fault_those_behind_read_the_declared_output_and_run_on",
    ),
    "The others of the chain run on, too, since not every chain has to stop.": (
        f"{_PEERS_FAULTS}after_a_fault_those_behind_read_the_declared_output_and_run_on",
    ),
    "Where a chain has to stop, a rule stops it in one transaction: see": (
        f"{_PEERS_FAULTS}a_rule_stops_the_whole_chain_after_a_fault_of_one",
    ),
    "**Here** the place of a `stop` among the steps of a transaction has no effect.": (
        f"{_PEERS}a_controller_that_stays_reads_one_reference_and_then_the_other",
    ),
    (
        "All steps take effect at one instant T: before T the component that stays reads the old "
        "reference, from T on the new one."
    ): (f"{_PEERS}a_controller_that_stays_reads_one_reference_and_then_the_other",),
    "This component misses no release.": (
        f"{_PEERS}a_controller_that_stays_reads_one_reference_and_then_the_other",
    ),
    "may read the declared output of the stopped component.": (
        "Rule10Commit.ALateOneTakesTheChangeAtTheEndOfItsState",
    ),
    "When this component has written, the second one connects the reader.": (
        f"{_PEERS}a_controller_follows_a_planner_that_has_written_since_its_start",
    ),
    "**Here** a fallback belongs to one component.": (f"{_PEERS_FAULTS}only_the_one_that_failed_falls_back",),
    "A fault puts in the fallback core of the failed component alone, at the next instant of its grid.": (
        f"{_PEERS_FAULTS}only_the_one_that_failed_falls_back",
    ),
    "Components that read from the same resource keep their cores and miss no release.": (
        f"{_PEERS_FAULTS}only_the_one_that_failed_falls_back",
    ),
    "The mechanism is a core that is kept prepared in its component: see": (
        f"{_PEERS_FAULTS}only_the_one_that_failed_falls_back",
    ),
    "**Here** a stop and a start keep the data of a core, so a core could do the same.": (
        f"{_PEERS}a_start_keeps_the_data_of_the_core_and_a_step_configure_clears_them",
    ),
    "Each start begins in the initial state of the": (
        f"{_PEERS}a_controller_that_starts_again_begins_where_the_joint_is",
    ),
    (
        "A core that reads the measured position in that state commands this position from the first "
        "instant on."
    ): (f"{_PEERS}a_controller_that_starts_again_begins_where_the_joint_is",),
    "Or a step `configure` before the start clears the data.": (
        f"{_PEERS}a_start_keeps_the_data_of_the_core_and_a_step_configure_clears_them",
    ),
    (
        "**Here** a new core with a `take` goes on from the last command of the old core, and misses "
        "no release."
    ): (f"{_PEERS}a_core_that_takes_over_goes_on_with_the_command_of_the_one_before",),
    "**Here** nothing goes back unless the component declares a `fallback` core.": (
        f"{_PEERS_FAULTS}a_new_core_that_fails_is_reported_and_what_runs_then_is_what_was_declared",
    ),
    (
        "Without a fallback, the component is `FAULTED`, its output is the declared one, and a start "
        "is refused until the component is repaired."
    ): (f"{_PEERS_FAULTS}a_new_core_that_fails_is_reported_and_what_runs_then_is_what_was_declared",),
    "With a fallback, each list names the core that runs, and keeps the reason of the fault.": (
        f"{_PEERS_FAULTS}a_new_core_that_fails_is_reported_and_what_runs_then_is_what_was_declared",
    ),
    "The takeover is an event: see": (
        "ros/simulation/test_executor.py::test_a_fallback_core_that_took_over_is_an_event",
    ),
    # ---- write a core
    "In C++ (`mauve_examples/tutorials/metronome.hpp` and `accelerando.hpp`): a shell, a core, an fsm.": (
        "python/project/test_readme_examples.py::test_listings_stand_in_the_sources",
    ),
    (
        "In Python (`mauve_examples/tutorials/python_cores.py`): a method for each action and "
        "guard of the fsm, whichever language that was written in."
    ): ("python/parts/test_cores.py::test_it_takes_the_place_of_a_core_in_cpp_and_gives_it_back",),
    "It runs in the component's own thread too, but under the interpreter's lock: soft real time.": (
        "python/parts/test_cores.py::test_its_hooks_run_on_ordinary_threads_its_actions_on_the_component_s",
    ),
    (
        "Both are listed, one line a class, in the package's ament index resource "
        "`mauve_rt_plugins` (`mauve_examples/plugins.txt`), and a component accepts what its "
        "architecture file names among its `alternatives`:"
    ): (
        "python/model/test_plugins.py::test_lines_of_an_index",
        "Rule9Replace.OnlyDeclaredCoresByName",
    ),
    (
        "install/lib/mauve_rt/executor --ros-args -p "
        "architecture:=install/share/mauve_examples/architecture/metronome.yaml &"
    ): ("python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",),
    (
        "install/lib/mauve_rt/executor --ros-args -p "
        "architecture:=install/share/mauve_examples/architecture/rover.yaml &"
    ): ("python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",),
    "mauve replace-core /executor metronome mauve_examples/Accelerando": (
        "python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",
    ),
    "mauve replace-core /executor metronome mauve_examples/PythonMetronome": (
        "python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",
    ),
    "mauve replace-core /executor metronome mauve_examples/Metronome": (
        "python/parts/test_cores.py::test_the_tutorial_s_architecture_file_takes_it",
    ),
    "`Architecture` and `Deployer` are C++ and Python classes that need neither ROS nor a file:": (
        "python/project/test_readme_examples.py::test_architecture_and_deployer_need_no_ros",
        _KERNEL_ALONE,
    ),
    "`mauve_examples/listings/` has the paper's Listings 1 to 3 as a program.": ("ctest: listings",),
    (
        "[The tutorials](../tutorials/01_first_component.md) go from a first component to a robot "
        "of your own, step by step."
    ): ("ros/test_tutorials.py::test_the_page_does_what_it_says",),
    "Whole components can be written in Python": (
        "python/parts/test_components.py::test_python_and_cpp_exchange_data_both_ways",
    ),
    (
        "`mauve_examples/tutorials/python_component.py` has a shell, a core and an fsm in Python "
        "beside a C++ component."
    ): ("python/parts/test_components.py::test_a_core_in_python_is_replaced_live_beside_cpp",),
    "mauve replace-core /executor rover mauve_examples/SlipperyRover": (
        "python/model/test_python_parts.py::test_the_rover_of_the_examples_takes_another_core",
    ),
    (
        "An architecture file names them as it names those in C++ "
        "(`mauve_examples/architecture/rover.yaml`); resources, too."
    ): (
        "python/model/test_python_parts.py::test_a_whole_component_of_a_file_runs_and_is_changed_in_flight",
        "python/model/test_python_parts.py::test_a_resource_of_a_file_has_its_parameter",
    ),
    "An fsm in Python needs a core in Python": (
        "python/model/test_python_parts.py::test_an_fsm_in_python_needs_a_core_in_python",
    ),
    "A test runs the same file in virtual time, and reads a resource by its message": (
        "python/model/test_python_parts.py::test_the_rover_of_the_examples_is_tested_as_the_page_says",
    ),
    (
        "**Rewiring while it runs** (`mauve_examples/reconfigurations/`): in `ros2 run "
        "mauve_examples mauve_sensor_breaks` (`install/lib/mauve_examples/mauve_sensor_breaks` "
        "without the ROS 2 command line) a laser's driver faults and the robot stands still."
    ): ("ctest: sensor_breaks",),
    "removes the old chain, and the robot drives again.": ("ctest: sensor_breaks",),
    (
        "In `mauve_gps_lost` localisation changes over from GPS to scan matching indoors and "
        "back, and its pose does not jump."
    ): ("ctest: gps_lost",),
    (
        "Both check from the trace that control kept its grid, print blackout and missed "
        "releases, and fail if there was a gap."
    ): ("ctest: sensor_breaks", "ctest: gps_lost"),
    (
        "A package of your own (`tests/downstream/` is a complete one), with "
        "`<depend>mauve_rt</depend>` in its `package.xml`:"
    ): ("doors/test_colcon.py::test_downstream_core_replaces_a_running_one",),
    # ---- parts and values
    (
        "A bag has the values of each resource that is bound to a topic (`topic: {name: beat, "
        "direction: publish}`)."
    ): (
        "python/project/test_readme_examples.py::test_the_python_example_plots_a_value",
        "ros/executor/test_recording.py::test_a_bag_begun_and_ended_while_the_executor_runs",
    ),
    (
        "| `bool configure_hook()` | on an ordinary thread, before the core runs | allocate and "
        "check; `false` or an exception: the core cannot be used |"
    ): (
        "python/project/test_cpp_parts.py::test_a_part_overrides_the_hooks_and_nothing_else",
        "Rule9Replace.RefusalsLeaveTheOldCoreRunning",
    ),
    (
        "| `void cleanup_hook()` | on an ordinary thread, after the core has run | give back what "
        "`configure_hook` took |"
    ): ("python/project/test_cpp_parts.py::test_a_part_overrides_the_hooks_and_nothing_else",),
    (
        "| `bool adopt(const CoreBase& old)` | in a wait of the component | `false` or an "
        "exception refuses the replacement |"
    ): ("Rule9Replace.RefusalsLeaveTheOldCoreRunning",),
    (
        "| `void take(CoreBase& old) noexcept` | in the same wait, after `adopt` | move the state "
        "of the old core over; [state fields](reload_code.md) (`MAUVE_STATE`) are copied before it |"
    ): ("Rule9Replace.RefusalsLeaveTheOldCoreRunning", "Handover.CopiesTheFieldsOfTheSameNameAndType"),
    "An exception of `adopt` carries its reason to the requester": (
        "HostConformance.ARefusalNamesItsComponentOnceAndItsReason",
    ),
    (
        "A core that replaces another one derives from the class for which the fsm was written, "
        "here `Metronome`: the fsm calls functions of this class."
    ): ("ros/executor/test_services.py::test_replace_core_in_flight_takes_over_the_count",),
    # ---- numbers in sentences whose quote above lacks them
    "nly then publishes one epoch, 20 ms ahead.": (
        "Rule5Deployment.AllComponentsShareOneEpochPublishedAfterAllAreReady",
        "HygieneOfTheKernel.NoPageFaultAfterTheStart",
        "system/test_figures.py::test_with_it_both_are_on_one_grid",
    ),
    "and BMP without compression (1, 4, 8, 24": (
        "BmpMaps.AreRefusedWithOneLineThatNamesWhatIsWrong",
        "BmpMaps.PalettesOfOneFourAndEightBits",
        "BmpMaps.ColoursOf32Bits",
        "MapFile.RefusesImagesThatCannotBeUsed",
    ),
    "4, 8, 24 or 32 bits a pixel, not of OS/2); - more": (
        "BmpMaps.AreRefusedWithOneLineThatNamesWhatIsWrong",
        "BmpMaps.PalettesOfOneFourAndEightBits",
        "BmpMaps.ColoursOf32Bits",
        "MapFile.RefusesImagesThatCannotBeUsed",
    ),
    "A PGM with a maximum value other than 255 and 65535, and the transparent colour of a PNG in RGB,": (
        "MapServerRule.SixteenBitsLoseTheLowerOnes",
    ),
    "so latencies and blackouts are 0.": (
        "system/test_demo_simulated.py::test_the_bags_hold_what_those_of_the_real_demo_hold",
    ),
    "for 10 periods,": ("ros/executor/test_hung.py::test_a_hung_component_is_told_until_it_goes_on",),
    (
        "1 s at least, or `hung_after_ms`) is an error there, on the console and in `mauve list`, "
        "until it does."
    ): ("ros/executor/test_hung.py::test_a_hung_component_is_told_until_it_goes_on",),
    "One transaction adds a camera, its filter and their resources, rewires the 1 kHz control loop,": (
        "ctest: sensor_breaks",
    ),
    # ---- real time
    (
        "`scripts/bench --gate` fails where a count that must be zero is not, or a whole interval is "
        "beyond its target."
    ): (
        "python/project/test_bench_docs.py::test_the_gate",
        "doors/test_bench_gate.py::test_the_counts_that_must_be_zero_are",
    ),
    "Without the rights to it everything runs all the same": (
        "ros/executor/test_process.py::test_without_real_time_rights_it_runs_and_says_so",
    ),
    "`require_realtime: true` in the architecture file refuses instead": (
        "ros/executor/test_process.py::test_require_realtime_refuses_to_run_without",
    ),
    "`scripts/bench --write-docs` writes this table: every row of one run on one machine.": (
        "python/project/test_bench_docs.py::test_no_figure_of_the_page_was_typed",
    ),
    (
        "Where a reference is shown, it was measured in turn with the figure, in the same run; the ratio is "
        "the median of the pairs with its 95 % bootstrap interval."
    ): (
        "python/project/test_bench_statistics.py::test_every_round_begins_with_another_side",
        "python/project/test_bench_statistics.py::test_the_interval_contains_the_true_median_about_as_often_as_it_says",
    ),
    # ---- see values
    "Every value that a resource holds can be seen.": (
        "ros/executor/test_values.py::test_values_of_every_kind_by_resource_and_by_port",
    ),
    "The programs that poll are ordinary load on the computer.": (
        "ros/executor/test_values.py::test_a_look_takes_nothing_away",
        "bench: , against an idle machine, p",
    ),
    "Nothing in the architecture file has to change.": (
        "ros/executor/test_values.py::test_a_look_takes_nothing_away",
        "bench: wake-up latency of a 1 kHz component, its value read 100 times a second",
    ),
    "A poll costs a component no more than one more reader does.": (
        "ros/executor/test_values.py::test_a_look_takes_nothing_away",
        "bench: wake-up latency of a 1 kHz component, its value read 100 times a second",
    ),
    "mauve echo /robot_1/executor pose # a resource; until Ctrl-C": (
        "ros/executor/test_values.py::test_echo",
    ),
    "mauve echo /robot_1/executor control.pose --once # the same by a port that is connected to it": (
        "ros/executor/test_values.py::test_echo",
    ),
    "mauve echo /robot_1/executor pose --field theta --rate 50": ("ros/executor/test_values.py::test_echo",),
    "mauve echo /robot_1/executor pose --csv # a line for each poll": (
        "ros/executor/test_values.py::test_echo_as_a_table",
    ),
    "The command polls 10 times a second, unless `--rate` gives another rate.": (
        "ros/executor/test_values.py::test_echo",
    ),
    "Writes between two polls are counted, not shown.": ("ros/executor/test_values.py::test_echo",),
    "Each value has the time of its writer and its age.": (
        "ros/executor/test_values.py::test_values_of_every_kind_by_resource_and_by_port",
    ),
    "Structs of your own are shown as messages are.": (
        "ros/executor/test_values.py::test_values_of_every_kind_by_resource_and_by_port",
    ),
    "An element of a `ring_buffer` stays in it: the command shows the element that was written last.": (
        "Ring.ALookShowsTheElementWrittenLastAndTakesNoneAway",
        "ros/executor/test_values.py::test_a_look_takes_nothing_away",
    ),
    "mauve mirror /robot_1/executor pose # on /robot_1/executor/mirror/pose": (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
    ),
    "mauve mirror /robot_1/executor pose --field theta --topic heading --rate 100": (
        "ros/executor/test_values.py::test_the_command_starts_and_stops_a_mirror",
    ),
    "mauve mirror /robot_1/executor pose --stop # without a value: all of them": (
        "ros/executor/test_values.py::test_the_command_starts_and_stops_a_mirror",
    ),
    (
        "A mirror publishes a value on a ROS topic while the executor runs, so that "
        "PlotJuggler, Foxglove, `rqt_plot` and `ros2 topic echo` draw it."
    ): ("ros/executor/test_values.py::test_mirrors_of_the_file",),
    (
        "The thread that sends messages polls the value, at most 50 times a second unless "
        "`--rate` gives another rate."
    ): (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
        "ros/executor/test_values.py::test_the_command_starts_and_stops_a_mirror",
    ),
    "A value that was not written since the last message is not published again.": (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
        "ros/executor/test_values.py::test_the_command_starts_and_stops_a_mirror",
    ),
    "| of a ROS message type | the same message |": (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
    ),
    "| one number of it (`--field`) | `std_msgs/msg/Float64` |": (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
    ),
    (
        "| a struct of your own | `mauve_msgs/msg/Values`; their names are on the topic "
        "`NAME/names`, latched |"
    ): ("ros/executor/test_values.py::test_a_mirror_of_an_own_struct",),
    "An architecture file starts mirrors with the executor:": (
        "ros/executor/test_values.py::test_mirrors_of_the_file",
    ),
    "A mirror ends with its resource.": (
        "ros/executor/test_values.py::test_a_mirror_ends_with_its_resource",
    ),
    "`mauve list` shows the mirrors.": ("python/cli/test_list_view.py::test_mirrors_of_a_resource",),
    "mauve watch /robot_1/executor /robot_2/executor --value pose:theta": (
        "ros/cli/test_watch.py::test_a_table_that_keys_change",
    ),
    "mauve watch /robot_1/executor --once # one table, without a terminal": (
        "ros/cli/test_watch.py::test_once_it_needs_no_terminal",
    ),
    (
        "The table has a line for each component: state, core, rate, worst wake-up and "
        "response of the last second, longest execution, overruns."
    ): (
        "ros/cli/test_watch.py::test_a_table_that_keys_change",
        "python/cli/test_watch_view.py::test_a_line_for_each_component",
    ),
    "Below it are the rules, the values that you named, and the last change.": (
        "python/cli/test_watch_view.py::test_rules_values_and_the_last_change",
    ),
    ("An executor that ends stays on the screen with its last values; when it is back, the table goes on."): (
        "ros/cli/test_watch.py::test_an_executor_may_end_and_come_back",
    ),
    "| `s` | sort by another column |": ("ros/cli/test_watch.py::test_a_table_that_keys_change",),
    "| `/` | show only components whose name or state has these letters |": (
        "ros/cli/test_watch.py::test_a_table_that_keys_change",
    ),
    "| up, down, Enter | open one component: ports, their values, properties |": (
        "ros/cli/test_watch.py::test_a_table_that_keys_change",
    ),
    "| Escape | back to the table |": ("ros/cli/test_watch.py::test_a_table_that_keys_change",),
    "| `p` | pause |": ("ros/cli/test_watch.py::test_a_table_that_keys_change",),
    "| `q` | quit |": ("ros/cli/test_watch.py::test_a_table_that_keys_change",),
    "The values of other resources are recorded by `--value` (": (
        "ros/executor/test_values.py::test_every_write_is_recorded",
    ),
    "mauve record start /robot_1/executor --value pose --value control.command": (
        "ros/executor/test_values.py::test_every_write_is_recorded",
    ),
    (
        "The bag has every write to these resources, not samples, on the topics "
        "`/robot_1/executor/values/pose` and so on: one message a write, with its definition."
    ): (
        "ros/executor/test_values.py::test_every_write_is_recorded",
        "ros/executor/test_values.py::test_every_write_is_recorded_in_virtual_time",
        "WriteLogs.KeepEveryWriteFromTheBeginToTheEnd",
    ),
    "So `rosbags`, `mcap` and Foxglove read structs of your own, too.": (
        "ros/executor/test_values.py::test_every_write_is_recorded",
    ),
    "The time of a message is the writer's.": ("WriteLogs.KeepEveryWriteFromTheBeginToTheEnd",),
    "A write that finds no room is counted among the dropped messages.": ("WriteLogs.CountWhatFindsNoRoom",),
    "An architecture file names values that are recorded whenever the executor records:": (
        "ros/executor/test_values.py::test_every_write_is_recorded",
    ),
    # ---- the house
    (
        "`scripts/lint` checks style, types, layers and includes, and builds `docs/` "
        "(`scripts/docs`); `.ci/run` is lint and test."
    ): (
        "python/project/test_readme_scripts.py::test_ci_runs_every_tool_and_every_test",
        "python/project/test_docs.py::test_lint_builds_the_pages",
    ),
    "Knows neither ROS nor Python |": (_KERNEL_ALONE,),
    "| folder | what |": ("python/project/test_readme_examples.py::test_the_folders_of_the_house_are_there",),
    (
        "Code that may run on such a thread is tagged `[rt]` in the C++ headers, and declared "
        "`MAUVE_RT` where other code has `noexcept`."
    ): ("python/project/test_check_tags.py::test_what_is_missing_or_untrue_is_named",),
    (
        "Declare functions of your own cores the same way: clang from 20 on then checks them, "
        "`-Wfunction-effects` while it compiles and `-fsanitize=realtime` while they run."
    ): ("Rt.SanitizerEndsWhoAllocates",),
    "reading needs no native library |": (
        "python/trace/test_without_the_library.py::test_a_bag_is_read_and_shown",
    ),
    "[The public API](../public_api.md) lists what programs may rely on; everything else may change.": (
        "python/project/test_public_api.py::test_what_a_module_offers_is_listed",
        "python/project/test_public_api.py::test_the_headers_are_those_of_the_one_door",
        "python/project/test_public_api.py::test_readme_shows_what_is_listed",
    ),
    "[CONTRIBUTING.md](CONTRIBUTING.md) says how to build and test one thing.": (
        "python/project/test_contributing.py::test_files_that_it_names_are_there",
    ),
    (
        "CONTRIBUTING.md says how to build and test one thing, and how to add a kind of resource, "
        "step, record, setting or reply code."
    ): ("python/project/test_contributing.py::test_files_that_it_names_are_there",),
    "LGPL-3.0-or-later": ("python/project/test_readme_examples.py::test_the_licence_is_the_one_named",),
}

# Sentences that say what something is called, where it stands or what to type next, and promise nothing more.
PROMISE_NOTHING = (
    "| `--revert-on` | violation | the old core goes in |",
    "| verdict | meaning |",
    "A core that moves its state out in its own `take` cannot give it back.",
    "| new code | message |",
    "The other direction needs two transactions.",
    "The first one starts the component that writes the reference.",
    "With one transaction, a reader that executes first reads once the output that was left by the stop.",
    "Users of ros2_control and dora reported these failures.",
    "A test re-enacts each failure with components in the place of controllers.",
    "Some failures are repaired there since; the links lead to the reports.",
    "the loop activated the controllers itself, and some activations made it overrun.",
    "a tool asked for the list of controllers every second, and the control loop missed cycles.",
    "one controller of a chain failed to activate.",
    "The other controllers of the chain followed a reference of zero, which nearly destroyed the robot.",
    "a controller failed in its update and was deactivated.",
    "The other controllers of the chain went on with an invalid reference.",
    "one request activated some controllers and deactivated the controller before them.",
    "The order was not the one that the user needed, and a controller that stayed active read NaN.",
    "A component that is",
    (
        "after a failure of one controller, the fallbacks of all controllers of its chain were "
        "activated, and were in conflict over resources."
    ),
    "a controller was activated a second time, after another controller.",
    "It could send the command that was left from the first time.",
    "a trajectory controller was activated after another controller had moved the joints.",
    "The robot shook, although no command was sent.",
    "The author of the core writes `take`: see",
    "a reloaded operator may fail.",
    "The proposal was to go back to the old operator.",
    "A reviewer objected that a user may miss the warning, and think that the new version runs.",
    "The mechanism is [prepare, commit, retire](replacing.md).",
    "The messages are:",
    "| value | topic |",
    "| key | effect |",
    "2 processors): the radio link is lost, a rule replaces the core of `exploration` on both robots.",
    "On the disk the demo takes 0.7 GB in the clone and 0.4 GB of system packages",
    (
        "On the disk the demo takes 0.7 GB in the clone (`.venv/` 0.5, whose files uv's cache in "
        "`~/.cache/uv` shares;"
    ),
    ("`build/` 0.1) and 0.4 GB of system packages; with the tests built and run, sanitized ones included,"),
    "it is 2.9 GB in the clone,",
    "for a while 0.8 GB in `/tmp`,",
    "and 0.5 GB of ccache in `~/.cache`.",
    "Intel Xeon) whose 2 processors others kept busy:",
    "its load average was 13 to 22.",
    "1 in 30,111 releases.*",
    "Three kinds of maps may give other cells than a map server",
    (
        "Before you build anything, download [a sample report](docs/sample/report.html) and open "
        "it in a browser."
    ),
    "*From the trace of a demo on 2026-11-26, on a virtual machine (KVM, AMD EPYC,",
    "Each tick is a release",
    "The replaced component was held for 14 us",
    "All else:",
    (
        "[install](docs/howto/install.md), [operate an executor](docs/howto/operate.md), [write a "
        "core](docs/howto/write_a_core.md), [see values](docs/howto/see_values.md), "
        "[record and report](docs/howto/record_and_report.md), "
        "[real-time rights](docs/howto/realtime_rights.md), [several "
        "machines](docs/several_machines.md), [is my robot "
        "schedulable?](docs/howto/is_my_robot_schedulable.md), [launch "
        "files](docs/howto/launch_files.md), [a service of systemd](docs/howto/systemd.md), [CI "
        "for your package](docs/howto/ci_for_your_package.md), "
        "[uninstall](docs/howto/uninstall.md) |"
    ),
    "The demo ends with:",
    (
        "**Yes**, if your robot must change its software while it moves: another controller on "
        "wet ground, a sensor that failed, an algorithm that is better than the one you started "
        "with; and if you have to show afterwards that no control loop missed a period."
    ),
    "**No**, or not alone, where:",
    "- you need a hard guarantee on a virtual machine: its host may take a processor at any time.",
    (
        "Use PREEMPT_RT on real hardware, and [measure](docs/concepts/performance.md); - a fault "
        "in C++ code must not end the process:"
    ),
    "SIGSEGV and abort do",
    (
        "Put such code into an executor of its own; - your control law is in Python and must be "
        "hard real time: parts in Python share the interpreter's lock; - you need drivers for "
        "hardware: ros2_control has them."
    ),
    "[write a core, and replace it live](docs/howto/write_a_core.md)",
    (
        "| | replaces an algorithm that runs | several changes at one instant | real time | what "
        "it has that MAUVE RT has not |"
    ),
    (
        "| ros2_control | switches controllers between two cycles of its update loop | "
        "controllers and their interfaces | one update loop, asynchronous controllers beside it | "
        "hardware drivers, many controllers, many users |"
    ),
    (
        "| Nav2 lifecycle manager | brings nodes down and up | nodes in order, one after the "
        "other | no | the navigation stack it manages |"
    ),
    (
        "| Orocos RTT | stops a component and starts another one | by scripts, not at one instant "
        "| a thread for each component, lock-free ports | twenty years of use, scripting, "
        "kinematics libraries |"
    ),
    (
        "| copper-rs | at compile time | at compile time | a task graph that is scheduled at "
        "compile time | replay that is deterministic by construction, no ROS needed |"
    ),
    "Each row is meant to be one that its authors would sign",
    "If a row is wrong, please open an issue",
    "| | |",
    (
        "| learn | nine tutorials, from [a first component](docs/tutorials/01_first_component.md) "
        "to [your own robot](docs/tutorials/09_your_own_robot.md) |"
    ),
    "| do | [install]",
    (
        "| when it fails | [messages and their remedies](docs/howto/troubleshooting.md), [find an "
        "overrun](docs/howto/find_an_overrun.md), [repair a faulted "
        "component](docs/howto/repair_a_faulted_component.md) |"
    ),
    (
        "| coming from | [rclpy, ros2_control, Nav2's lifecycle manager, Orocos "
        "RTT](docs/howto/coming_from.md) |"
    ),
    (
        "| understand | [components](docs/concepts/components.md), [time and "
        "grids](docs/concepts/time_and_grids.md), [resources](docs/concepts/resources.md), "
        "[deployment](docs/concepts/deployment.md), [replacement and "
        "transactions](docs/concepts/replacing.md), [faults](docs/concepts/faults.md), [basic "
        "elements](docs/concepts/basic_elements.md), [rules](docs/concepts/rules_overview.md), "
        "[simulated time](docs/concepts/simulated_time.md), [traces](docs/concepts/traces.md), "
        "[timing proof](docs/concepts/timing_proof.md), "
        "[performance](docs/concepts/performance.md), [the paper, section by "
        "section](docs/concepts/paper.md), [the paper's figures](docs/figures.md), "
        "[glossary](docs/concepts/glossary.md) |"
    ),
    (
        "| look up | [reference](docs/reference/index.md): files, commands, parameters, messages, "
        "errors, traces; [rules](docs/rules.md), [public API](docs/public_api.md), [source "
        "tree](docs/concepts/source_tree.md) |"
    ),
    "`scripts/lint` takes 0.3 GB more",
    (
        "The demo's verdict is about its supervisors' swaps: where you swap the algorithm by hand "
        "in time, it may end with FAILED."
    ),
    "MAUVE RT is a component framework on ROS 2 Jazzy",
    "It implements and extends the design of D",
    "Doose, C",
    "Grand and C",
    (
        "Lesire, *MAUVE Runtime: a component-based middleware to reconfigure software "
        "architectures in real-time*."
    ),
    "On Debian 12 or Ubuntu 24.04 with git and python3, nothing else prepared:",
    "*The report of a run of 2026-11-22, in real time, on a virtual machine (KVM,",
    "Chosen because no stall of the machine is in it; of six such runs one had an overrun,",
    (
        "*The same run: both robots, their components' executions, and the reconfigurations when "
        "the link was lost and came back.*"
    ),
    "And the services are there for anyone:",
    "An executor of your own:",
    "They save code:",
    "| element | effect |",
    "`mauve plugins` lists all of them",
    "| part | content |",
    "`scripts/figures` draws them again",
    "| the component | repair |",
    "[Repair a faulted component](../howto/repair_a_faulted_component.md) has the commands.",
    "[Record and report](../howto/record_and_report.md) has the commands.",
    "| the new fsm | goes on |",
    "`mauve_examples/architecture/supervisor.yaml` has the mission's rules.",
    "[Rules](../rules.md) describes conditions, priorities and tools.",
    "| command | use |",
    "`mauve_examples/architecture/robot.yaml` is the mission's",
    "`DIR_csv/topic.beat.csv`",
    ("While the robot runs, plot the topic with any ROS tool, such as `rqt_plot /beat/data` or PlotJuggler."),
    "A C++ core may override these functions",
    "| function | runs | purpose |",
    '`throw std::runtime_error("the map is empty")`',
    "Functions that the new core changes have to be `virtual`",
    "A **component** is three things",
    "| **shell** | the part that other components see: ports and properties |",
    "| **core** | data and algorithms; a core may use its shell |",
    "| **fsm** | the states, which say when which method of the core runs |",
    "An fsm may also wait for an *event*",
    "[Time and grids](time_and_grids.md) explains instants, overruns and epochs with an example.",
    "**Resources** hold data and offer services that ports connect to",
    "`executor: {sender: {priority: 70, cpus:",
    "[0]}}`.",
    "The kinds are:",
    "| kind | content |",
    "T is an instant of the components' clocks",
    "Architecture files name the elements for common ROS types directly",
    "**Architecture files** are YAML",
    "Your machine will show others: run it.",
    "| --- |",
    "| `mauve_msgs/` | the ROS interface package |",
    "| `mauve_rt/kernel/` | the C++ library: components, time, threads, reconfiguration.",
    ("| `mauve_rt/rules/` | rules decided and carried out beside the components, in C++ over the kernel |"),
    "| `mauve_rt/bindings/` | the kernel for Python, translated only |",
    "| `mauve_rt/bridge/` | resources on ROS topics and services, in C++ over rcl |",
    "| `mauve_rt/parts/` | how parts are written in Python |",
    "| `mauve_rt/model/` | architecture files: schema, loading, checks |",
    (
        "| `mauve_rt/control/`, `mauve_rt/supervision/` | requests carried out or refused; rules. "
        "Both without ROS |"
    ),
    ("| `mauve_rt/node/`, `mauve_rt/interfaces/` | executor and supervisor as ROS nodes; their messages |"),
    "| `mauve_rt/simulation/` | the same in virtual time |",
    "| `mauve_rt/analysis/` | the task model of a timing analysis, and response times |",
    "| `mauve_rt/trace/` | recording, reading, measuring and showing traces;",
    "| `mauve_rt/cli/` | the command `mauve` |",
    "| `mauve_examples/` | the mission, tutorials, maps |",
    "| `benchmarks/` | `scripts/bench`: figures as ratios to a reference of the same run |",
    "Licence:",
    "From Python:",
    "A **rule** lets a robot degrade gracefully",
)
