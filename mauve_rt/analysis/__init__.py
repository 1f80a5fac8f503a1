"""Response times of components, computed from their parameters: no ROS, no native library, no measurement.

`machines` describes components, `digraph` their jobs, `demand` the work of these jobs in an interval,
`blocking` bounds priority inversion, and `digraph_times` joins them for all components of one CPU. `bounds`
takes what can be known of an architecture, `verdict` judges it. All times are whole nanoseconds: no formula
uses a floating-point number.
"""
