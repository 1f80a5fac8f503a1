// SPDX-License-Identifier: LGPL-3.0-or-later
// Random transactions, failing ones among them, over 8 components at 1 kHz and 50 at 100 Hz.
//   bench_soak [--count 1000] [--priority 60] [--cpus 2] [--seed 1]
// After each the architecture is described and compared with what it should be; differences are told on the
// standard error. Prints {"made": transactions that came into force, "refused": that did not, "differences":
// after which the architecture was not as expected, or that came into force or failed unexpectedly, "releases": of components that the transaction at the time did not touch, "missed": of them,
// "missed_in_stalls": of the machine, "heap_bytes": [...], in use each time a tenth was done and all that was
// added was removed, "resident_bytes": [...], "blackout_ns": [...]}.
#include <malloc.h>

#include <fstream>
#include <limits>
#include <memory>

#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"
#include "support/soak_model.hpp"
#include "support/soak_parts.hpp"
#include "support/witness.hpp"

namespace {

using mauve::time_ns_t;

constexpr int kFast = 8, kSlow = 50;
constexpr std::int64_t kFastUs = 1'000, kSlowUs = 10'000;

/// Follows the releases of all components through the trace.
class ReleaseWatch {
 public:
  explicit ReleaseWatch(mauve::Architecture& architecture) : architecture_(architecture) {}

  using Numbers = std::set<std::uint16_t>;

  Numbers numbers_of(const std::set<std::string>& names) const {
    Numbers numbers;
    for (const auto& component : architecture_.components()) {
      if (names.contains(component->name())) numbers.insert(component->task().number());
    }
    return numbers;
  }
  /// What the touched ones do is their change's business, and what they do next follows nothing.
  void look(const mauve::TraceDrain& drain, const Numbers& touched = {}) {
    for (const std::uint16_t number : touched) last_.erase(number);
    for (const std::uint64_t dropped : drain.dropped) {
      if (dropped != 0) throw std::runtime_error("trace records were lost");
    }
    for (const mauve::TraceRecord& record : drain.records) {
      if (record.kind == static_cast<std::uint16_t>(mauve::TraceKind::deployment)) {
        period_[record.component] = record.c;
      } else if (record.kind == static_cast<std::uint16_t>(mauve::TraceKind::release) &&
                 !touched.contains(record.component)) {
        follow(record.component, record.a);
      }
    }
  }
  bench::Missed count(const std::vector<std::unique_ptr<bench::Witness>>& witnesses) const {
    bench::Missed missed;
    for (const Gap& gap : gaps_) {
      // Whose CPU it was does not matter: a stall of any CPU can keep a change and its components waiting.
      bench::Missed best{.ours = std::numeric_limits<std::int64_t>::max()};
      for (const auto& witness : witnesses) {
        const bench::Missed here =
            bench::count_missed(gap.before_ns, gap.after_ns, gap.period_ns, witness->end());
        if (here.ours < best.ours) best = here;
      }
      missed += best;
    }
    return missed;
  }
  std::int64_t releases() const { return releases_; }

 private:
  struct Gap {
    time_ns_t before_ns;
    time_ns_t after_ns;
    time_ns_t period_ns;
  };

  void follow(std::uint16_t component, time_ns_t nominal_ns) {
    const auto [place, is_first] = last_.try_emplace(component, nominal_ns);
    if (is_first) return;
    ++releases_;
    const time_ns_t period_ns = period_.at(component);
    if (nominal_ns - place->second > period_ns) gaps_.push_back({place->second, nominal_ns, period_ns});
    place->second = nominal_ns;
  }

  mauve::Architecture& architecture_;
  std::map<std::uint16_t, time_ns_t> last_;
  std::map<std::uint16_t, time_ns_t> period_;
  std::vector<Gap> gaps_;
  std::int64_t releases_{0};
};

std::int64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::int64_t total = 0;
  std::int64_t resident = 0;
  file >> total >> resident;
  return resident * 4096;
}

class Soak {
 public:
  explicit Soak(const bench::Options& options)
      : count_(options.number("count", 1000)),
        priority_(static_cast<int>(options.number("priority", 60))),
        cpus_(static_cast<int>(options.number("cpus", 2))),
        pause_(options.seed(), {0, 2'000}) {
    bench::register_soak_parts(registry_);
    for (int i = 0; i < 3; ++i)
      architecture_.add_resource<mauve::SharedData<bench::Small>>("resource_" + std::to_string(i));
    for (int i = 0; i < kFast; ++i) add("fast_" + std::to_string(i), kFastUs, priority_, i % cpus_);
    for (int i = 0; i < kSlow; ++i) add("slow_" + std::to_string(i), kSlowUs, priority_ - 10, i % cpus_);
    architecture_.configure();
    deployer_.deploy();
    for (int cpu = 0; cpu < cpus_; ++cpu) witnesses_.push_back(std::make_unique<bench::Witness>(cpu));
    blackouts_.reserve(static_cast<std::size_t>(count_) + 10);  // our own books do not grow
    expected_ = architecture_.describe();
    model_ = std::make_unique<bench::SoakModel>(options.seed(), describe_extra(), extra_parts(),
                                                expected_.resources.front());
  }

  void run() {
    for (std::int64_t i = 0; i < count_; ++i) {
      pause_();
      carry_out(model_->draft(expected_));
      if ((i + 1) % std::max<std::int64_t>(1, count_ / 10) == 0) weigh();
    }
    deployer_.shutdown();
    watch_.look(deployer_.drain_trace());
    const bench::Missed missed = watch_.count(witnesses_);
    bench::JsonLine()
        .add("made", made_)
        .add("refused", refused_)
        .add("differences", differences_)
        .add("releases", watch_.releases())
        .add("missed", missed.ours)
        .add("missed_in_stalls", missed.machines)
        .add("heap_bytes", heap_bytes_)
        .add("resident_bytes", resident_bytes_)
        .add("blackout_ns", blackouts_)
        .print();
  }

 private:
  void add(const std::string& name, std::int64_t period_us, int priority, int cpu) {
    mauve::Component& component =
        architecture_.add_component(name, "soak/Shell", "soak/Core", "soak/Fsm",
                                    mauve::TaskSettings{.priority = priority, .cpus = {cpu}});
    component.allow({"soak/OtherCore", "soak/Refusing"}, true);
    component.set_property("period_us", period_us);
  }
  mauve::ComponentParts extra_parts() const {
    return {.shell = "soak/Shell",
            .core = "soak/Core",
            .fsm = "soak/Fsm",
            .settings = {.priority = priority_ - 5, .cpus = {0}},
            .properties = {{"period_us", std::int64_t{kFastUs}}},
            .alternatives = {"soak/OtherCore", "soak/Refusing"}};
  }
  /// What an added component looks like is learnt from one.
  mauve::ComponentFacts describe_extra() {
    deployer_.commit(std::move(mauve::Transaction().add_component("pattern", extra_parts())), patient_);
    mauve::ComponentFacts facts;
    for (const mauve::ComponentFacts& each : architecture_.describe().components) {
      if (each.name == "pattern") facts = each;
    }
    deployer_.commit(std::move(mauve::Transaction().remove_component("pattern")), patient_);
    return facts;
  }

  void carry_out(bench::SoakDraft draft) {
    watch_.look(deployer_.drain_trace());
    ReleaseWatch::Numbers touched = watch_.numbers_of(draft.touched);
    std::string outcome = "it was made";
    bool made = false;
    try {
      const mauve::TransactionReport report = deployer_.commit(std::move(draft.transaction), patient_);
      made = true;
      if (report.blackout_ns > 0) blackouts_.push_back(report.blackout_ns);
      touched.merge(watch_.numbers_of(draft.touched));
      watch_.look(deployer_.drain_trace(), touched);
    } catch (const mauve::Error& error) {
      outcome = error.what();
    }
    ++(made ? made_ : refused_);
    if (draft.valid) expected_ = std::move(draft.expected);
    mauve::ArchitectureDescription found = architecture_.describe();
    if (made == draft.valid && found == expected_) return;
    ++differences_;
    std::cerr << draft.text << outcome << "; expected\n"
              << to_string(expected_) << "\nfound\n"
              << to_string(found) << '\n';
    expected_ = std::move(found);
  }

  /// Without what was added, so that one time can be compared with another.
  void weigh() {
    bench::SoakDraft reset = model_->draft_reset(expected_);
    if (!reset.transaction.steps().empty()) carry_out(std::move(reset));
    heap_bytes_.push_back(static_cast<std::int64_t>(mallinfo2().uordblks));
    resident_bytes_.push_back(resident_bytes());
  }

  std::int64_t count_;
  int priority_;
  int cpus_;
  bench::RandomPause pause_;
  const mauve::TransactionOptions patient_{.timeouts = {.commit_ns = mauve::s_to_ns(10), .phase_ns = 0}};

  mauve::PluginRegistry registry_;
  mauve::Architecture architecture_{&registry_};
  mauve::Deployer deployer_{architecture_};
  std::vector<std::unique_ptr<bench::Witness>> witnesses_;
  ReleaseWatch watch_{architecture_};
  std::unique_ptr<bench::SoakModel> model_;
  mauve::ArchitectureDescription expected_;

  std::int64_t made_{0};
  std::int64_t refused_{0};
  std::int64_t differences_{0};
  std::vector<std::int64_t> heap_bytes_;
  std::vector<std::int64_t> resident_bytes_;
  std::vector<std::int64_t> blackouts_;
};

void measure(const bench::Options& options) { Soak(options).run(); }

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
