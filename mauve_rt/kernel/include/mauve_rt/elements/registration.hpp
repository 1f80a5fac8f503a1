// SPDX-License-Identifier: LGPL-3.0-or-later
// The basic elements of one data type, under names for architecture files.
#pragma once

#include <string>

#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/elements/multiplexer.hpp"
#include "mauve_rt/elements/relay.hpp"
#include "mauve_rt/elements/servers.hpp"

namespace mauve {

/// Inputs of the multiplexers that architecture files can name; those not needed are left unconnected.
inline constexpr std::size_t kNamedMultiplexerInputs = 4;

/// Registers a shell as <name>Shell and the fsm that runs any UpdateCore of it as <name>Fsm. [setup]
template <typename ShellType>
void register_updated(PluginRegistry& registry, const std::string& name) {
  registry.shell<ShellType>(name + "Shell");
  registry.fsm<PeriodicUpdateFsm<ShellType>>(name + "Fsm", name + "Shell");
}

/// Registers an UpdateCore as <name>, with its shell and fsm. [setup]
template <typename CoreType>
void register_element(PluginRegistry& registry, const std::string& name) {
  register_updated<typename CoreType::shell_type>(registry, name);
  registry.core<CoreType>(name, name + "Shell");
}

/// Registers a ServerShell, or one derived from it, as <name>ServerShell, and the fsms that run any ServerCore of it as
/// <name>SporadicFsm, PollingServerFsm and DeferrableServerFsm. [setup]
template <typename ShellType>
void register_server(PluginRegistry& registry, const std::string& name) {
  const std::string shell = name + "ServerShell";
  registry.shell<ShellType>(shell);
  registry.fsm<SporadicFsm<ShellType>>(name + "SporadicFsm", shell);
  registry.fsm<PollingServerFsm<ShellType>>(name + "PollingServerFsm", shell);
  registry.fsm<DeferrableServerFsm<ShellType>>(name + "DeferrableServerFsm", shell);
}

/// Registers the type and its elements: <prefix>Source, Sink and Filter as shell and fsm, and a server's shell and fsms (the core
/// is the user's), <prefix>Relay, Multiplexer and PriorityMultiplexer as shell, core and fsm. [setup]
///
///   MAUVE_PLUGINS(registry) { mauve::register_elements<Scan>(registry, "my_package/Scan"); }
template <Described T>
void register_elements(PluginRegistry& registry, const std::string& prefix) {
  registry.type<T>();
  register_updated<SourceShell<T>>(registry, prefix + "Source");
  register_updated<SinkShell<T>>(registry, prefix + "Sink");
  register_updated<FilterShell<T>>(registry, prefix + "Filter");
  register_server<ServerShell<T>>(registry, prefix);
  register_element<RelayCore<T>>(registry, prefix + "Relay");
  register_element<MultiplexerCore<T, kNamedMultiplexerInputs>>(registry, prefix + "Multiplexer");
  register_element<PriorityMultiplexerCore<T, kNamedMultiplexerInputs>>(registry,
                                                                        prefix + "PriorityMultiplexer");
}

}  // namespace mauve
