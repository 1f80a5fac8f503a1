// SPDX-License-Identifier: LGPL-3.0-or-later
// What each kind of step makes of the draft. All throw Error. Ordinary threads.
#pragma once

#include "mauve_rt/change/transaction.hpp"

#include "change/draft.hpp"

namespace mauve {

void put_core(Draft& draft, const std::string& component, std::unique_ptr<CoreBase> core, bool by_name);
void place_core_in(Draft& draft, const std::string& component, std::unique_ptr<CoreBase> core);
void put_fsm(Draft& draft, const std::string& component, std::unique_ptr<FsmBase> fsm,
             Component::FsmFactory make_fsm);
void put_shell(Draft& draft, const std::string& component, std::unique_ptr<Shell> shell);
void put_component(Draft& draft, const std::string& name, Parts parts, const ComponentParts& rest,
                   Component::FsmFactory make_fsm, std::unique_ptr<CoreBase> fallback);
void put_start(Draft& draft, const std::string& name, std::optional<time_ns_t> clock_ns);
void put_stop(Draft& draft, const std::string& name);
void put_configure(Draft& draft, const std::string& name);
/// Makes a registered fsm, as often as asked.
Component::FsmFactory factory_of(const Draft& draft, const std::string& fsm);

}  // namespace mauve
