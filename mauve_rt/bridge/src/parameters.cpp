// SPDX-License-Identifier: LGPL-3.0-or-later
#include "parameters.hpp"

#include <rcl/allocator.h>
#include <rcl/arguments.h>
#include <rcl_yaml_param_parser/parser.h>

#include <memory>

#include "rcl_error.hpp"

namespace mauve::bridge {

namespace {

template <typename Array>
auto vector_of(const Array& array) {
  return std::vector<std::remove_cvref_t<decltype(*array.values)>>(array.values, array.values + array.size);
}

std::vector<std::string> strings_of(const rcutils_string_array_t& array) {
  return {array.data, array.data + array.size};
}

ParameterValue value_of(const rcl_variant_t& value) {
  if (value.bool_value != nullptr) return *value.bool_value;
  if (value.integer_value != nullptr) return *value.integer_value;
  if (value.double_value != nullptr) return *value.double_value;
  if (value.string_value != nullptr) return std::string(value.string_value);
  if (value.bool_array_value != nullptr) return vector_of(*value.bool_array_value);
  if (value.integer_array_value != nullptr) return vector_of(*value.integer_array_value);
  if (value.double_array_value != nullptr) return vector_of(*value.double_array_value);
  if (value.string_array_value != nullptr) return strings_of(*value.string_array_value);
  return std::vector<std::string>{};  // an empty list: rcl knows no type of it
}

NodeParameters node_parameters(const rcl_params_t& all, std::size_t node) {
  NodeParameters found{.nodes = all.node_names[node], .values = {}};
  const rcl_node_params_t& its = all.params[node];
  for (std::size_t i = 0; i < its.num_params; ++i)
    found.values.emplace_back(its.parameter_names[i], value_of(its.parameter_values[i]));
  return found;
}

}  // namespace

std::vector<NodeParameters> parameters_of(const std::vector<std::string>& words) {
  std::vector<const char*> argv;
  argv.reserve(words.size());
  for (const std::string& word : words) argv.push_back(word.c_str());
  rcl_arguments_t arguments = rcl_get_zero_initialized_arguments();
  check(rcl_parse_arguments(static_cast<int>(argv.size()), argv.data(), rcl_get_default_allocator(),
                            &arguments),
        "the ROS arguments cannot be read", "--ros-args");
  const auto end_arguments = [](rcl_arguments_t* one) { (void)went_well(rcl_arguments_fini(one)); };
  const std::unique_ptr<rcl_arguments_t, decltype(end_arguments)> ends(&arguments);
  rcl_params_t* params = nullptr;
  check(rcl_arguments_get_param_overrides(&arguments, &params), "the parameters cannot be read",
        "--ros-args");
  if (params == nullptr) return {};
  const std::unique_ptr<rcl_params_t, decltype(&rcl_yaml_node_struct_fini)> freed(params,
                                                                                  &rcl_yaml_node_struct_fini);
  std::vector<NodeParameters> found;
  found.reserve(params->num_nodes);
  for (std::size_t node = 0; node < params->num_nodes; ++node)
    found.push_back(node_parameters(*params, node));
  return found;
}

}  // namespace mauve::bridge
