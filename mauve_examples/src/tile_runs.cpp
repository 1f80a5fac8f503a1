// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/tile_runs.hpp"

#include <array>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

namespace {

constexpr std::array<std::int8_t, 3> kStates{kUnknown, kFree, kOccupied};  // by what stands for them
constexpr unsigned kStateShift = 6;
constexpr std::size_t kLongestRun = std::size_t{1} << kStateShift;

std::uint8_t code_of(std::int8_t state) noexcept {
  if (state == kUnknown) return 0;
  return state == kFree ? 1 : 2;
}

bool append_number(std::uint16_t number, TileRuns& runs) noexcept {
  return runs.push_back(static_cast<std::uint8_t>(number & 0xFFU)) &&
         runs.push_back(static_cast<std::uint8_t>(number >> 8U));
}

}  // namespace

bool append_tile(const MapTile& tile, TileRuns& runs) noexcept {
  const std::size_t before = runs.size();
  bool room = append_number(tile.column, runs) && append_number(tile.row, runs);
  for (std::size_t begin = 0; room && begin < kTileCells;) {
    std::size_t end = begin + 1;
    while (end < kTileCells && end - begin < kLongestRun && tile.cells[end] == tile.cells[begin]) ++end;
    const std::size_t code = std::size_t{code_of(tile.cells[begin])} << kStateShift;
    room = runs.push_back(static_cast<std::uint8_t>(code | (end - begin - 1)));
    begin = end;
  }
  if (!room) runs.resize(before);
  return room;
}

bool read_tile(const TileRuns& runs, std::size_t& position, MapTile& tile) noexcept {
  constexpr std::size_t kHead = 4;
  if (runs.size() - position < kHead) return false;
  const std::uint8_t* head = &runs[position];
  tile.column = static_cast<std::uint16_t>(head[0] | head[1] << 8U);
  tile.row = static_cast<std::uint16_t>(head[2] | head[3] << 8U);
  position += kHead;
  for (std::size_t cell = 0; cell < kTileCells;) {
    if (position == runs.size()) return false;
    const std::uint8_t run = runs[position++];
    const std::size_t code = run >> kStateShift;
    const std::size_t length = (run & (kLongestRun - 1)) + 1;
    if (code >= kStates.size() || length > kTileCells - cell) return false;
    for (const std::size_t end = cell + length; cell < end; ++cell) tile.cells[cell] = kStates[code];
  }
  return true;
}

}  // namespace mauve_examples
