/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The amplifier's output stage with the actuator's capacitance as its load. */
#include "catalogue.h"
#include "first_order_lag.h"

const block_t block_amplifier_bandwidth = {.name = "amplifier_bandwidth",
                                           .place = PLACE_ELECTRONICS,
                                           .text = "first-order low pass of the amplifier and its load",
                                           .parameter = first_order_lag_parameters,
                                           .parameters = 1,
                                           .state_bytes = sizeof(first_order_lag_t),
                                           .open = first_order_lag_open,
                                           .settle = first_order_lag_settle,
                                           .step = first_order_lag_step};
