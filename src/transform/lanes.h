// SPDX-License-Identifier: MIT
// Includes LANE_TEMPLATE, which the includer defines, once for lanes of 8 bits and once for lanes of 16. It sees LANE (the type),
// NONE (its greatest number), W(name), which begins the names that it defines, and the vectors' V(name) and CLEAR_WHERE.

#define LANE uint8_t
#define NONE UINT8_MAX
#define W(name) l1_u8_##name
#define V(name) name##_u8
#define CLEAR_WHERE clear_where_u8
#include LANE_TEMPLATE
#undef LANE
#undef NONE
#undef W
#undef V
#undef CLEAR_WHERE

#define LANE uint16_t
#define NONE UINT16_MAX
#define W(name) l1_u16_##name
#define V(name) name##_u16
#define CLEAR_WHERE clear_where_u16
#include LANE_TEMPLATE
#undef LANE
#undef NONE
#undef W
#undef V
#undef CLEAR_WHERE

#undef LANE_TEMPLATE
