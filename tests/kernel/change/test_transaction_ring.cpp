// SPDX-License-Identifier: LGPL-3.0-or-later
// A transaction gives a ring a second reader while both ends are in use: its wait-free end gets a lock, and no element is lost.
#include "fixtures.hpp"

namespace mauve::testing::test_transaction_ring {

class RingTransactions : public Deployed {
 protected:
  /// Takes fewer at each release than are written: a second reader finds some as well.
  void take(Component& component, std::vector<double>& into) {
    into.reserve(kMost);
    core(component).work = [&core = core(component), &into] {
      for (int i = 0; i < kWritten - 1 && into.size() < into.capacity(); ++i) {
        const Sample<Number> sample = core.exposed_shell().input.read();
        if (sample.is_new()) into.push_back(sample.value.value);
      }
    };
  }

  static constexpr int kWritten = 5;  // at each release
  static constexpr std::size_t kMost = 100'000;
};

TEST_F(RingTransactions, GiveEveryElementOnceWhileAReaderComesAndGoes) {
  auto& ring = architecture.add_resource<RingBuffer<Number>>("ring", std::size_t{4096});
  Component& writer = add("writer");
  Component& reader = add("reader");
  Component& visitor = add("visitor");
  std::vector<double> taken[2];
  double written = 0;
  const ComponentsEndFirst guard(deployer);
  take(reader, taken[0]);
  take(visitor, taken[1]);
  architecture.configure();
  architecture.connect("writer", "held", "ring", "write");
  architecture.connect("reader", "input", "ring", "read");
  core(writer).work = [&core = core(writer), &written] {
    for (int i = 0; i < kWritten; ++i) {
      if (core.exposed_shell().held.write({written})) ++written;
    }
  };
  deployer.deploy();
  for (int round = 0; round < 20; ++round) {
    EXPECT_EQ(has_process_barrier(), ring.read.is_wait_free());
    deployer.commit(std::move(Transaction().connect("visitor", "input", "ring", "read")), {});
    EXPECT_FALSE(ring.read.is_wait_free());
    EXPECT_EQ(has_process_barrier(), ring.write.is_wait_free()) << "its writer is still alone";
    wait_runs(reader, core(reader).runs + 3);
    wait_runs(visitor, core(visitor).runs + 3);
    deployer.commit(std::move(Transaction().disconnect("visitor", "input")), {});
    wait_runs(reader, core(reader).runs + 3);
  }
  deployer.stop("writer");
  deployer.stop("reader");
  ReadPort<Number> rest("rest");
  rest.connect(ring.read, "ring");
  for (Sample<Number> sample = rest.read(); sample.is_new(); sample = rest.read())
    taken[0].push_back(sample.value.value);
  rest.disconnect();
  std::vector<int> times(static_cast<std::size_t>(written), 0);
  for (const auto& list : taken) {
    EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
    for (const double value : list) ++times[static_cast<std::size_t>(value)];
  }
  EXPECT_GT(times.size(), 100U);
  EXPECT_FALSE(taken[1].empty()) << "the visitor was given some";
  EXPECT_EQ(static_cast<std::ptrdiff_t>(times.size()), std::count(times.begin(), times.end(), 1));
}

}  // namespace mauve::testing::test_transaction_ring
