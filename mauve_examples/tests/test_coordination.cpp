// SPDX-License-Identifier: LGPL-3.0-or-later
// Who takes which frontier, and what is said about it: peers, batches of tiles, bids, rounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "mauve_examples/explorer.hpp"
#include "mauve_examples/tile_runs.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_coordination {

PeerMessage from(const char* sender, std::uint32_t sequence, std::uint32_t round = 0) {
  PeerMessage message;
  message.sender = RobotName(sender);
  message.sequence = sequence;
  message.round = round;
  return message;
}

PeerMessage acking(PeerMessage message, const char* peer, std::uint32_t sequence, std::uint32_t round,
                   std::uint32_t batch = 0) {
  message.acks.push_back({RobotName(peer), sequence, round, batch});
  return message;
}

TEST(PeerTable, OnlyAnAnswerToTheVeryRoundCounts) {
  PeerTable peers;
  peers.configure("a", {"b", "c"});
  EXPECT_FALSE(peers.all_answered(1));
  peers.receive(acking(from("b", 1), "a", 3, 2), 5);
  peers.receive(acking(from("c", 1), "a", 3, 1), 5);
  EXPECT_TRUE(peers.all_answered(1));
  EXPECT_FALSE(peers.all_answered(2));
  peers.receive(acking(from("c", 2), "a", 4, 2), 5);
  EXPECT_TRUE(peers.all_answered(2));
}

TEST(PeerTable, AnswersToSomebodyElseDoNotCount) {
  PeerTable peers;
  peers.configure("a", {"b"});
  peers.receive(acking(from("b", 1), "c", 3, 9), 5);
  EXPECT_FALSE(peers.all_answered(1));
}

TEST(PeerTable, TellsRestartedPeersAndAnswersToAnEarlierLife) {
  PeerTable peers;
  peers.configure("a", {"b"});
  using Received = PeerTable::Received;
  EXPECT_EQ(peers.receive(from("b", 7, 4), 5), Received::news);
  EXPECT_EQ(peers.receive(from("b", 7, 4), 5), Received::repeated);
  EXPECT_EQ(peers.receive(from("x", 1), 5), Received::stranger);
  EXPECT_EQ(peers.receive(from("b", 1, 1), 5), Received::restarted);
  EXPECT_EQ(peers.find("b")->highest_round, 1U);
  peers.receive(acking(from("b", 2), "a", 900, 50), 5);  // this robot has only sent 5 messages
  EXPECT_FALSE(peers.all_answered(1));
}

TEST(PeerTable, AloneEverybodyHasAnswered) {
  PeerTable peers;
  peers.configure("a", {});
  EXPECT_TRUE(peers.all_answered(1));
}

std::vector<MapTile> tiles_of(const TileRuns& runs) {
  std::vector<MapTile> tiles;
  MapTile tile;
  for (std::size_t position = 0; read_tile(runs, position, tile);) tiles.push_back(tile);
  return tiles;
}

TEST(TileRuns, HoldTilesAsTheyAre) {
  TileRuns runs;
  MapTile uniform;
  uniform.column = 300;
  uniform.row = 7;
  uniform.cells.fill(kFree);
  ASSERT_TRUE(append_tile(uniform, runs));
  EXPECT_EQ(runs.size(), 8U) << "a tile without walls costs next to nothing";
  MapTile mixed;
  for (std::size_t i = 0; i < kTileCells; ++i)
    mixed.cells[i] = std::array{kFree, kOccupied, kUnknown}[i / 5 % 3];
  ASSERT_TRUE(append_tile(mixed, runs));
  const std::vector<MapTile> read = tiles_of(runs);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].column, 300);
  EXPECT_EQ(read[0].row, 7);
  EXPECT_EQ(read[0].cells, uniform.cells);
  EXPECT_EQ(read[1].cells, mixed.cells);
}

TEST(TileRuns, ATileWithoutRoomIsNotBegun) {
  MapTile worst;
  for (std::size_t i = 0; i < kTileCells; ++i) worst.cells[i] = i % 2 == 0 ? kFree : kUnknown;
  TileRuns runs;
  while (append_tile(worst, runs)) {
  }
  EXPECT_EQ(runs.size(), TileRuns::capacity() / 260 * 260);
  EXPECT_EQ(tiles_of(runs).size(), TileRuns::capacity() / 260);
}

TEST(TileRuns, WhatIsNoTileEndsThem) {
  MapTile tile;
  tile.cells.fill(kOccupied);
  TileRuns whole;
  append_tile(tile, whole);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    TileRuns cut = whole;
    cut.resize(size);
    EXPECT_TRUE(tiles_of(cut).empty()) << size;
  }
  TileRuns no_state = whole;
  no_state[4] = 0xFF;
  EXPECT_TRUE(tiles_of(no_state).empty());
  TileRuns too_long = whole;
  too_long[4] = 0x40;
  EXPECT_TRUE(tiles_of(too_long).empty());
}

TEST(TileSender, ABatchStaysUnderWayUnchangedUntilAllHaveIt) {
  OccupancyGrid own;
  own.configure({160, 160, 1.0, 0.0, 0.0});
  MergedMap map;
  map.configure(own.geometry());
  // Every second cell of 100 tiles: nothing is dearer.
  for (int i = 0; i < 160 * 160; i += 2) own.observe_free({i % 160, i / 160});
  map.refresh(own);
  TileSender sender;
  sender.configure(map.tile_count());
  sender.start(map);
  EXPECT_EQ(sender.batch(), 1U);
  const std::vector<MapTile> sent = tiles_of(sender.runs());
  ASSERT_EQ(sent.size(), 63U);
  own.observe_free({sent[0].column * 16 + 1, sent[0].row * 16});
  map.refresh(own);
  sender.start(map);
  EXPECT_EQ(tiles_of(sender.runs())[0].cells, sent[0].cells);
  sender.confirm();
  sender.start(map);
  EXPECT_EQ(sender.batch(), 2U);
  EXPECT_EQ(tiles_of(sender.runs()).size(), 38U);  // the other 37 and the one that changed meanwhile
  sender.confirm();
  sender.start(map);
  EXPECT_EQ(sender.batch(), 0U);
  sender.forget();
  sender.start(map);
  EXPECT_EQ(sender.batch(), 3U);
}

/// The same world in finer cells.
GridMap refined(const GridMap& coarse, double resolution_m) {
  GridMap fine;
  fine.resolution_m = resolution_m;
  fine.origin_x_m = coarse.origin_x_m;
  fine.origin_y_m = coarse.origin_y_m;
  fine.width = static_cast<int>(coarse.width * coarse.resolution_m / resolution_m);
  fine.height = static_cast<int>(coarse.height * coarse.resolution_m / resolution_m);
  fine.cells.resize(fine.cell_count());
  for (std::size_t i = 0; i < fine.cells.size(); ++i) {
    const Point at = fine.centre(fine.cell(i));
    fine.cells[i] = coarse.cells[coarse.index(coarse.cell_at(at.x, at.y))];
  }
  return fine;
}

class LateLinks : public ::testing::TestWithParam<double> {};

TEST_P(LateLinks, FourRobotsKnowTheSameWithin20Seconds) {
  // While the link was down the first has explored the whole office, 48 m x 32 m, the others a quarter each.
  const GridMap world = refined(load_map(testing::own_map("office")), GetParam());
  constexpr std::size_t kRobots = 4;
  constexpr std::array kNames{"robot_1", "robot_2", "robot_3", "robot_4"};
  std::vector<std::unique_ptr<Explorer>> robots;
  for (std::size_t i = 0; i < kRobots; ++i) {
    OccupancyGrid own;
    own.configure(world);
    for (std::size_t cell = 0; cell < world.cells.size(); ++cell) {
      const Cell at = world.cell(cell);
      const int quarter = at.column * 2 / world.width + 2 * (at.row * 2 / world.height);
      if (i != 0 && quarter != static_cast<int>(i)) continue;
      if (world.cells[cell] == kFree) own.observe_free(at);
      if (world.cells[cell] == kOccupied) own.observe_hit(at);
    }
    std::vector<std::string> peers;
    for (std::size_t j = 0; j < kRobots; ++j) {
      if (j != i) peers.emplace_back(kNames[j]);
    }
    robots.push_back(std::make_unique<Explorer>());
    robots[i]->configure(world, kNames[i], peers, {});
    robots[i]->refresh(own);
  }

  // The exploration's period is 500 ms; the robots' are out of step.
  constexpr int kTicksOf20s = 40;
  auto message = std::make_unique<PeerMessage>();
  int ticks = 0;
  const auto agree = [&] {
    return std::all_of(robots.begin(), robots.end(), [&](const auto& robot) {
      return std::equal(robot->map().cells().begin(), robot->map().cells().end(), world.cells.begin());
    });
  };
  while (!agree() && ticks < 200) {
    ++ticks;
    for (std::size_t i = 0; i < kRobots; ++i) {
      robots[i]->compose(*message);
      EXPECT_LE(message->tiles.size() * sizeof(MapTile) + message->map_runs.size(), 16384U)
          << "what a robot sends is bounded";
      for (std::size_t j = 0; j < kRobots; ++j) {
        if (j != i) robots[j]->receive(*message);
      }
    }
  }
  EXPECT_LE(ticks, kTicksOf20s);
  RecordProperty("seconds", std::to_string(0.5 * ticks));
}

INSTANTIATE_TEST_SUITE_P(Resolutions, LateLinks, ::testing::Values(0.1, 0.05, 0.03));

FrontierList frontiers(std::initializer_list<Frontier> list) {
  FrontierList result;
  for (const Frontier& frontier : list) result.push_back(frontier);
  return result;
}

PeerMessage bidding(PeerMessage message, std::initializer_list<Bid> bids) {
  for (const Bid& bid : bids) message.bids.push_back(bid);
  return message;
}

TEST(Auction, TheLowerBidWinsAContestedFrontier) {
  const FrontierList own = frontiers({{{0.0, 0.0, 0.0}, 1.0, 4.0}, {{50.0, 0.0, 0.0}, 1.0, 30.0}});
  PeerTable peers;
  peers.configure("b", {"a"});
  peers.receive(bidding(from("a", 1, 1), {{0.5, 0.0, 3.0}, {50.5, 0.0, 31.0}}), 0);
  EXPECT_EQ(bid_together(own, peers, {}), 1U);
  peers.receive(bidding(from("a", 2, 1), {{0.5, 0.0, 5.0}, {50.5, 0.0, 31.0}}), 0);
  EXPECT_EQ(bid_together(own, peers, {}), 0U);
}

TEST(Auction, EqualBidsGoByName) {
  const FrontierList own = frontiers({{{0.0, 0.0, 0.0}, 1.0, 4.0}, {{50.0, 0.0, 0.0}, 1.0, 30.0}});
  PeerTable peers;
  peers.configure("b", {"a"});
  peers.receive(bidding(from("a", 1, 1), {{0.0, 0.0, 4.0}}), 0);
  EXPECT_EQ(bid_together(own, peers, {}), 1U);
  peers.configure("b", {"c"});
  peers.receive(bidding(from("c", 1, 1), {{0.0, 0.0, 4.0}}), 0);
  EXPECT_EQ(bid_together(own, peers, {}), 0U);
}

TEST(Auction, ClaimsAreRespectedUnlessOneIsMuchNearer) {
  PeerTable peers;
  peers.configure("a", {"b"});
  PeerMessage message = from("b", 1);
  message.has_claim = true;
  message.claim = {0.5, 0.0, 10.0};
  peers.receive(message, 0);
  EXPECT_EQ(bid_together(frontiers({{{0.0, 0.0, 0.0}, 1.0, 6.0}}), peers, {}), std::nullopt);
  EXPECT_EQ(bid_together(frontiers({{{0.0, 0.0, 0.0}, 1.0, 4.0}}), peers, {}), 0U);
  EXPECT_TRUE(is_undercut({0.0, 0.0, 21.0}, peers, {}));
  EXPECT_FALSE(is_undercut({0.0, 0.0, 19.0}, peers, {}));
  EXPECT_FALSE(is_undercut({9.0, 0.0, 21.0}, peers, {}));
}

TEST(Auction, AloneTheCheapestAwayFromLastClaimsIsTaken) {
  PeerTable peers;
  peers.configure("a", {"b"});
  PeerMessage message = from("b", 1);
  message.has_claim = true;
  message.claim = {0.0, 0.0, 1.0};
  peers.receive(message, 0);
  EXPECT_EQ(choose_alone(frontiers({{{0.0, 0.0, 0.0}, 1.0, 6.0}, {{20.0, 0.0, 0.0}, 1.0, 9.0}}), peers, {}),
            1U);
  EXPECT_EQ(choose_alone(frontiers({{{0.0, 0.0, 0.0}, 1.0, 6.0}, {{20.0, 0.0, 0.0}, 1.0, 19.0}}), peers, {}),
            0U);
  EXPECT_EQ(choose_alone({}, peers, {}), std::nullopt);
}

/// Two robots at the ends of a corridor that both see half of.
class Rounds : public ::testing::Test {
 protected:
  void SetUp() override {
    truth_.width = 200;
    truth_.height = 20;
    truth_.resolution_m = 0.1;
    map_.configure(truth_);
    for (int column = 50; column < 150; ++column) {
      for (int row = 0; row < 20; ++row) map_.observe_free({column, row});
    }
    explorer_.configure(truth_, "a", {"b"}, {});
    explorer_.refresh(map_);
  }
  PeerMessage& compose() {
    explorer_.compose(*message_);
    return *message_;
  }

  GridGeometry truth_;
  OccupancyGrid map_;
  Explorer explorer_;
  std::unique_ptr<PeerMessage> message_ = std::make_unique<PeerMessage>();
  Pose2D pose_{7.0, 1.0, 0.0};
};

TEST_F(Rounds, NoGoalIsTakenBeforeThePeerHasAnswered) {
  for (std::int64_t tick = 0; tick < 100; ++tick) {
    explorer_.look(pose_, tick);
    EXPECT_FALSE(explorer_.decide_together(tick));
    EXPECT_EQ(compose().round, 1U);
    EXPECT_FALSE(message_->bids.empty());
    explorer_.receive(
        acking(from("b", static_cast<std::uint32_t>(tick) + 1), "a", 1, 0));  // it heard an earlier message
  }
  explorer_.receive(acking(from("b", 200), "a", 50, 1));
  explorer_.look(pose_, 100);
  EXPECT_TRUE(explorer_.decide_together(100));
  EXPECT_NEAR(explorer_.destination().x, 5.05, 0.1);  // the nearer end
  EXPECT_EQ(compose().round, 0U);
  EXPECT_TRUE(message_->has_claim);
  EXPECT_NEAR(message_->claim.cost, 2.0, 0.5);
}

TEST_F(Rounds, TwoOpenRoundsAnswerEachOther) {
  Explorer other;
  other.configure(truth_, "b", {"a"}, {});
  other.refresh(map_);
  auto theirs = std::make_unique<PeerMessage>();
  bool mine_taken = false;
  bool theirs_taken = false;
  for (std::int64_t tick = 0; tick < 3; ++tick) {
    explorer_.look(pose_, tick);
    mine_taken |= explorer_.decide_together(tick);
    other.look({13.0, 1.0, 0.0}, tick);
    theirs_taken |= other.decide_together(tick);
    compose();
    other.compose(*theirs);
    explorer_.receive(*theirs);
    other.receive(*message_);
  }
  EXPECT_TRUE(mine_taken);
  EXPECT_TRUE(theirs_taken);
  EXPECT_NEAR(explorer_.destination().x, 5.05, 0.1);
  EXPECT_NEAR(other.destination().x, 14.95, 0.1);
}

TEST_F(Rounds, ARobotWithNothingLeftStillAnswers) {
  OccupancyGrid known;
  known.configure({20, 20, 0.1, 0.0, 0.0});
  for (int i = 0; i < 400; ++i) known.observe_free({i % 20, i / 20});
  Explorer idle;
  idle.configure(known.geometry(), "b", {"a"}, {});
  idle.receive(from("a", 1, 17));
  idle.look({1.0, 1.0, 0.0}, 0);
  EXPECT_FALSE(idle.done()) << "it has not even looked yet";
  idle.refresh(known);
  idle.look({1.0, 1.0, 0.0}, 0);
  EXPECT_TRUE(idle.done());
  EXPECT_FALSE(idle.decide_together(0));
  idle.compose(*message_);
  EXPECT_EQ(message_->round, 0U);
  ASSERT_EQ(message_->acks.size(), 1U);
  EXPECT_EQ(message_->acks[0].round, 17U);
}

TEST_F(Rounds, TilesArriveAndAreAcknowledged) {
  Explorer other;
  other.configure(truth_, "b", {"a"}, {});
  explorer_.look(pose_, 0);
  compose();
  ASSERT_EQ(message_->map_batch, 1U);
  other.receive(*message_);
  EXPECT_EQ(other.map().cells()[truth_.index({100, 10})], kFree);
  auto answer = std::make_unique<PeerMessage>();
  other.compose(*answer);
  EXPECT_EQ(answer->acks[0].map_batch, 1U);
  EXPECT_EQ(answer->map_batch, 0U);  // it has seen nothing itself
  explorer_.receive(*answer);
  EXPECT_EQ(compose().map_batch, 0U);
}

TEST_F(Rounds, TilesOfAnotherGridAreAcknowledgedButNotMerged) {
  GridGeometry shifted = truth_;
  shifted.origin_x_m = 1.0;
  Explorer other;
  other.configure(shifted, "b", {"a"}, {});
  explorer_.look(pose_, 0);
  other.receive(compose());
  EXPECT_EQ(other.map().cells()[truth_.index({100, 10})], kUnknown);
  EXPECT_EQ(other.peers().peers()[0].merged_batch, 1U);
}

TEST_F(Rounds, AGoalWithoutProgressIsGivenUpForAWhile) {
  explorer_.configure(truth_, "a", {}, {});
  explorer_.refresh(map_);
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  explorer_.look(pose_, 0);
  ASSERT_TRUE(explorer_.decide_together(0));
  const Point first = explorer_.destination();
  for (std::int64_t t = 1; t < 10; ++t) {
    explorer_.look(pose_, t * kSecond_ns);
    EXPECT_FALSE(explorer_.decide_together(t * kSecond_ns)) << t;
  }
  explorer_.look(pose_, 10 * kSecond_ns);
  EXPECT_FALSE(explorer_.goal().active());
  EXPECT_TRUE(explorer_.decide_together(10 * kSecond_ns));
  EXPECT_GT(distance_m(explorer_.destination(), first), 5.0);
}

TEST_F(Rounds, AnExploredGoalIsDropped) {
  explorer_.configure(truth_, "a", {}, {});
  explorer_.refresh(map_);
  explorer_.look(pose_, 0);
  ASSERT_TRUE(explorer_.decide_alone(0));
  for (int column = 0; column < 50; ++column) {
    for (int row = 0; row < 20; ++row) map_.observe_free({column, row});
  }
  explorer_.refresh(map_);
  explorer_.look(pose_, 1);
  EXPECT_FALSE(explorer_.goal().active());
}

}  // namespace mauve_examples::test_coordination
