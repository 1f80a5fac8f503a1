"""Words that are no names in C++ or in Python: also for CMake's mauve_generate_types()."""

import keyword

CPP = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t
    char32_t class co_await co_return co_yield compl concept const const_cast consteval constexpr
    constinit continue decltype default delete do double dynamic_cast else enum explicit export extern
    false float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr
    operator or or_eq private protected public register reinterpret_cast requires return short signed
    sizeof static static_assert static_cast struct switch template this thread_local throw true try
    typedef typeid typename union unsigned using virtual void volatile wchar_t while xor xor_eq
    """.split()  # noqa: SIM905 - a list would have a line for each
)


def languages_of_keyword(name: str) -> list[str]:
    """The languages, C++ and Python, in which a word is no name."""
    is_one = {"C++": name in CPP, "Python": keyword.iskeyword(name)}
    return [language for language, found in is_one.items() if found]
