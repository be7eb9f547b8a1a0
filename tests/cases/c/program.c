/* Three networks in one program. Prints the first check that fails, or that all have passed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "changing.h"
#include "four_tank.h"
#include "started.h"

#define CHECK(condition)                                           \
    do {                                                           \
        if (!(condition)) {                                        \
            printf("line %d: %s does not hold\n", __LINE__, #condition); \
            exit(EXIT_FAILURE);                                    \
        }                                                          \
    } while (0)

/* Every function says what it was not given, and then has done nothing. */
static void refuse_mistakes(void) {
    union {
        four_tank_left left;
        unsigned char bytes[sizeof(four_tank_left) + 8];
    } room;
    four_tank_left *left = &room.left;
    four_tank_left *askew = (four_tank_left *)(void *)(room.bytes + 1);
    double x[2], u[1], y[2] = {0.0, 0.0}, input[1] = {7.0};
    uint8_t message[FOUR_TANK_LEFT_MESSAGE_BYTES];
    int32_t which = 5;
    dpc_status status;

    CHECK(four_tank_design() == FOUR_TANK_DESIGN);
    CHECK(four_tank_left_size() <= sizeof *left && sizeof *left < four_tank_left_size() + 8);
    CHECK(four_tank_left_steady_state(NULL, x, u) == DPC_NULL);
    CHECK(four_tank_left_steady_state(y, x, NULL) == DPC_NULL);
    CHECK(four_tank_left_steady_state(y, x, u) == DPC_OK);

    memset(&room, 0x5a, sizeof room);
    CHECK(four_tank_left_step(left, x, y, input, message, &status) == DPC_NOT_STARTED && input[0] == 7.0);
    CHECK(four_tank_left_accept(left, message, sizeof message) == DPC_NOT_STARTED);
    CHECK(four_tank_left_start(NULL, sizeof *left, x, u, message, NULL) == DPC_NULL);
    CHECK(four_tank_left_start(left, sizeof *left - 8, x, u, message, NULL) == DPC_SIZE);
    CHECK(four_tank_left_start(askew, sizeof *left, x, u, message, NULL) == DPC_MISALIGNED);
    y[0] = 90.0;
    CHECK(four_tank_left_steady_state(y, x, u) == DPC_OK);
    CHECK(four_tank_left_start(left, sizeof *left, x, u, message, &which) == DPC_START_OUTPUT_OUTSIDE && which == -1);
    y[0] = 0.0;
    x[0] = x[1] = 0.0;
    u[0] = 900.0;
    CHECK(four_tank_left_start(left, sizeof *left, x, u, message, &which) == DPC_START_INPUT_OUTSIDE && which == 0);
    u[0] = NAN;
    CHECK(four_tank_left_start(left, sizeof *left, x, u, message, &which) == DPC_START_NOT_FINITE);
    CHECK(four_tank_left_step(left, x, y, input, message, &status) == DPC_NOT_STARTED);
    u[0] = 0.0;
    CHECK(four_tank_left_start(left, sizeof *left, x, u, message, &which) == DPC_OK && which == -1);

    CHECK(four_tank_left_step(left, NULL, y, input, message, &status) == DPC_NULL && input[0] == 7.0);
    CHECK(four_tank_left_step(left, x, y, NULL, message, &status) == DPC_NULL);
    CHECK(four_tank_right_accept((four_tank_right *)(void *)left, message, sizeof message) == DPC_NOT_STARTED);
    CHECK(four_tank_left_accept(left, NULL, sizeof message) == DPC_NULL);
    CHECK(four_tank_left_accept(left, message, 0) == DPC_MESSAGE_LENGTH);
    CHECK(four_tank_left_accept(left, message, (size_t)-1 / 2 + 2) == DPC_LENGTH);
    CHECK(four_tank_left_accept(left, message, sizeof message) == DPC_MESSAGE_SENDER);
    CHECK(four_tank_left_step(left, x, y, input, message, NULL) == DPC_OK && input[0] == 0.0);
    CHECK(strcmp(four_tank_result_text(DPC_NOT_STARTED), four_tank_result_text(DPC_OK)) != 0);
    CHECK(four_tank_result_text(-1) == NULL && four_tank_control_text(99) == NULL);
    CHECK(four_tank_left_row_name(0) != NULL && four_tank_left_row_name(FOUR_TANK_LEFT_ROWS) == NULL);
}

/* What a status says of messages: of another design, late, and none. */
static void tell_what_became_of_messages(void) {
    four_tank_left left;
    four_tank_right right;
    uint8_t from_left[FOUR_TANK_LEFT_MESSAGE_BYTES], from_right[FOUR_TANK_RIGHT_MESSAGE_BYTES];
    double x[2] = {0.0, 0.0}, u[1] = {0.0}, y[1] = {0.0};
    double x_ref[2], y_ref[1], u_nom[1];
    dpc_status status;
    int32_t code;
    int64_t step;

    CHECK(four_tank_left_start(&left, sizeof left, x, u, from_left, NULL) == DPC_OK);
    CHECK(four_tank_right_start(&right, sizeof right, x, u, from_right, NULL) == DPC_OK);
    from_right[8] ^= 1;
    CHECK(four_tank_left_accept(&left, from_right, sizeof from_right) == DPC_MESSAGE_DESIGN);
    four_tank_left other = left; /* as good as the first */
    CHECK(four_tank_left_step(&left, x, y, u, from_left, &status) == DPC_OK);
    CHECK(status.messages_missing == 1 && !status.guaranteed && status.degraded);
    CHECK(four_tank_left_delivery(&left, 0, &code, NULL) == DPC_OK && code == DPC_DELIVERY_OTHER_DESIGN);
    CHECK(four_tank_left_delivery(&left, 1, &code, NULL) == DPC_NO_SUCH_NEIGHBOUR);
    CHECK(four_tank_left_delivery(&left, 0, NULL, NULL) == DPC_NULL);

    from_right[8] ^= 1;
    CHECK(four_tank_left_accept(&other, from_right, sizeof from_right) == DPC_OK);
    y[0] = 1.0;
    CHECK(four_tank_left_input(&other, x, u, &status) == DPC_OK);
    CHECK(status.control == DPC_CONTROL_AT_REFERENCE && status.references == DPC_REFERENCES_NONE);
    CHECK(four_tank_left_references(&other, y, from_left, &status) == DPC_OK);
    CHECK(status.control == DPC_CONTROL_AT_REFERENCE && status.references == DPC_REFERENCES_NEAREST && status.guaranteed);
    CHECK(four_tank_left_telemetry(&other, x_ref, NULL, y_ref, NULL, u_nom) == DPC_OK);
    CHECK(x_ref[0] == 0.0 && y_ref[0] == 0.0 && u_nom[0] == u[0]);
    CHECK(four_tank_left_accept(&other, from_right, sizeof from_right) == DPC_MESSAGE_OUT_OF_SEQUENCE);
    CHECK(four_tank_left_step(&other, x, y, u, from_left, &status) == DPC_OK);
    CHECK(four_tank_left_delivery(&other, 0, &code, &step) == DPC_OK);
    CHECK(code == DPC_DELIVERY_OUT_OF_SEQUENCE && step == -1);

    /* A state far out is told by the name of the row that it breaks. */
    x[1] = -60.0;
    CHECK(four_tank_left_step(&other, x, y, u, from_left, &status) == DPC_OK);
    CHECK(status.control == DPC_CONTROL_INFEASIBLE && !status.guaranteed);
    CHECK(four_tank_left_row_name((uint32_t)status.control_row) != NULL);
    CHECK(fabs(u[0]) <= 3.0);
}

/* Starts away from rest, with loads in one subsystem and a measurement error in another; and designs that do not talk to each other. */
static void start_away_from_rest(void) {
    started_type type;
    started_tanks_1_2 tanks;
    started_plane plane;
    started_con con;
    started_con_start_plan plan;
    uint8_t from_type[STARTED_TYPE_MESSAGE_BYTES], from_tanks[STARTED_TANKS_1_2_MESSAGE_BYTES];
    uint8_t from_plane[STARTED_PLANE_MESSAGE_BYTES], from_con[STARTED_CON_MESSAGE_BYTES];
    uint8_t from_left[FOUR_TANK_LEFT_MESSAGE_BYTES];
    double x_type[2], x_tanks[1], x_plane[2], loads[2], u[2], y[2] = {1.0, 2.0};
    const double nothing[8] = {0.0};
    four_tank_left left;
    dpc_status status;
    int32_t which;

    CHECK(started_type_stated_start(x_type) == DPC_OK);
    CHECK(started_type_start_planned(&type, sizeof type, started_type_stated_plan(), x_type, from_type, NULL) == DPC_OK);
    CHECK(started_tanks_1_2_stated_start(x_tanks, loads) == DPC_OK && x_tanks[0] == 3.0 && loads[0] == 0.1);
    CHECK(started_tanks_1_2_start_planned(&tanks, sizeof tanks, started_tanks_1_2_stated_plan(), loads, x_tanks, from_tanks, NULL) == DPC_OK);
    CHECK(started_plane_stated_start(x_plane) == DPC_OK);
    CHECK(started_plane_start_planned(&plane, sizeof plane, started_plane_stated_plan(), x_plane, from_plane, NULL) == DPC_OK);
    x_plane[0] = -9.0;
    CHECK(started_plane_start_planned(&plane, sizeof plane, started_plane_stated_plan(), x_plane, from_plane, &which) == DPC_START_STATE_DOES_NOT_FIT);
    CHECK(which >= 0 && started_plane_row_name((uint32_t)which) != NULL);
    x_plane[0] = 1.5;

    CHECK(started_type_accept(&type, from_tanks, sizeof from_tanks) == DPC_OK);
    CHECK(started_type_accept(&type, from_plane, sizeof from_plane) == DPC_OK);
    CHECK(started_type_step(&type, x_type, y, u, from_type, &status) == DPC_OK);
    CHECK(status.guaranteed && status.references == DPC_REFERENCES_PLANNED);
    CHECK(started_tanks_1_2_step(&tanks, x_tanks, y, loads, u, from_tanks, &status) == DPC_OK);
    CHECK(status.guaranteed && status.load_within);
    loads[0] = 0.9;
    CHECK(started_tanks_1_2_step(&tanks, x_tanks, y, loads, u, from_tanks, &status) == DPC_OK);
    CHECK(!status.load_within && !status.guaranteed);
    CHECK(started_tanks_1_2_start_planned(&tanks, sizeof tanks, started_tanks_1_2_stated_plan(), loads, x_tanks, from_tanks, &which) == DPC_START_LOAD_OUTSIDE);
    CHECK(which == 0);

    /* A plan of one's own: to stay at 0. */
    CHECK(started_con_plan(&plan, sizeof plan, 7, nothing, 3, nothing, nothing, nothing) == DPC_OK);
    CHECK(started_con_start_planned(&con, sizeof con, &plan, nothing, from_con, NULL) == DPC_OK);
    for (int t = 0; t < 4; t++) {
        CHECK(started_con_step(&con, nothing, nothing, u, from_con, &status) == DPC_OK && status.guaranteed);
        CHECK(status.references == (t == 0 ? DPC_REFERENCES_PLANNED : DPC_REFERENCES_NEAREST));
    }
    CHECK(started_con_plan(&plan, sizeof plan, 7, nothing, 2, nothing, nothing, nothing) == DPC_OK);
    CHECK(started_con_start_planned(&con, sizeof con, &plan, nothing, from_con, NULL) == DPC_START_PLAN_TOO_SHORT);
    CHECK(started_con_plan(&plan, sizeof plan, 0, nothing, 3, nothing, nothing, nothing) == DPC_OK);
    CHECK(started_con_start_planned(&con, sizeof con, &plan, nothing, from_con, NULL) == DPC_START_NO_PLAN);
    CHECK(started_con_plan(&plan, sizeof plan, 7, NULL, 3, nothing, nothing, nothing) == DPC_NULL);
    memset(&plan, 0, sizeof plan);
    CHECK(started_con_start_planned(&con, sizeof con, &plan, nothing, from_con, NULL) == DPC_NOT_STARTED);

    CHECK(four_tank_left_start(&left, sizeof left, nothing, nothing, from_left, NULL) == DPC_OK);
    CHECK(four_tank_left_accept(&left, from_tanks, sizeof from_tanks) == DPC_MESSAGE_DESIGN);
    CHECK(started_type_accept(&type, from_left, sizeof from_left) == DPC_MESSAGE_DESIGN);
}

/* Rows that all members redraw alike. */
static void redraw_rows(void) {
    changing_robot_1 first;
    changing_robot_2 second;
    changing_lift lift;
    uint8_t from_first[CHANGING_ROBOT_1_MESSAGE_BYTES], from_second[CHANGING_ROBOT_2_MESSAGE_BYTES];
    uint8_t from_lift[CHANGING_LIFT_MESSAGE_BYTES];
    const double rest[CHANGING_LIFT_NETWORK_NY] = {-2.0, 0.0, 2.0, 0.0, 1.0};
    const double apart[4] = {1.0, 0.0, -1.0, 0.0}, wall[2] = {1.0, 0.0}, together[5] = {0.0, 0.5, 0.0, 0.5, 1.0};
    double x[3][4], u[3][2], outputs[5] = {0.0};
    const double goal[2] = {3.0, 0.0}, other_goal[2] = {-3.0, 0.0};
    dpc_status status;
    int32_t which;

    CHECK(changing_robot_1_steady_state(rest, x[0], u[0]) == DPC_OK);
    CHECK(changing_robot_2_steady_state(rest, x[1], u[1]) == DPC_OK);
    CHECK(changing_lift_steady_state(rest, x[2], u[2]) == DPC_OK);
    CHECK(changing_robot_1_start(&first, sizeof first, x[0], u[0], from_first, NULL) == DPC_OK);
    CHECK(changing_robot_2_start(&second, sizeof second, x[1], u[1], from_second, NULL) == DPC_OK);
    CHECK(changing_lift_start(&lift, sizeof lift, x[2], u[2], from_lift, NULL) == DPC_OK);
    CHECK(changing_robot_1_accept(&first, from_second, sizeof from_second) == DPC_OK);
    CHECK(changing_robot_1_meeting(&first, 2, outputs, 5) == DPC_REDRAW_NOT_HEARD);
    CHECK(changing_robot_1_redraw(&first, 2, together, 5, 10.0, &which) == DPC_REDRAW_NOT_HEARD && which >= 0);
    CHECK(changing_robot_1_accept(&first, from_lift, sizeof from_lift) == DPC_OK);
    CHECK(changing_robot_2_accept(&second, from_first, sizeof from_first) == DPC_OK);
    CHECK(changing_robot_2_accept(&second, from_lift, sizeof from_lift) == DPC_OK);

    CHECK(changing_robot_1_meeting(&first, 2, outputs, 4) == DPC_LENGTH && outputs[0] == 0.0);
    CHECK(changing_robot_1_meeting(&first, 2, outputs, 5) == DPC_OK);
    CHECK(memcmp(outputs, rest, sizeof rest) == 0);
    CHECK(changing_robot_1_meeting(&first, 3, outputs, 5) == DPC_REDRAW_NO_SUCH_ROW);
    CHECK(changing_robot_1_redraw(&first, 0, apart, 3, -0.5, NULL) == DPC_LENGTH);
    CHECK(changing_robot_1_redraw(&first, 0, apart, 4, NAN, NULL) == DPC_REDRAW_NOT_FINITE);
    CHECK(changing_robot_1_redraw(&first, 0, apart, 4, -0.5, NULL) == DPC_OK);
    CHECK(changing_robot_1_redraw(&first, 1, wall, 2, -1.2, NULL) == DPC_REDRAW_EXCEEDED);
    CHECK(changing_robot_1_redraw(&first, 2, together, 5, 10.0, NULL) == DPC_OK);
    changing_robot_1 without = first;
    CHECK(changing_robot_1_step(&without, x[0], goal, u[0], from_first, &status) == DPC_OK);
    CHECK(status.references == DPC_REFERENCES_UNDRAWN);
    CHECK(strcmp(changing_robot_1_constraint_name((uint32_t)status.references_row), "moving wall") == 0);
    CHECK(changing_robot_1_redraw(&first, 1, wall, 2, 1.5, NULL) == DPC_OK);
    CHECK(changing_robot_1_step(&first, x[0], goal, u[0], from_first, &status) == DPC_OK && status.guaranteed);

    CHECK(changing_robot_2_redraw(&second, 0, apart, 4, -0.5, NULL) == DPC_OK);
    CHECK(changing_robot_2_redraw(&second, 1, together, 5, 10.0, NULL) == DPC_OK);
    CHECK(changing_robot_2_step(&second, x[1], other_goal, u[1], from_second, &status) == DPC_OK && status.guaranteed);
    CHECK(strcmp(changing_robot_2_constraint_name(0), "lift `above` robot-2") == 0);
    /* yref of the next but one step, the first number of a message. */
    double moved;
    memcpy(&moved, from_first + 32, sizeof moved);
    CHECK(moved > -1.9);
    memcpy(&moved, from_second + 32, sizeof moved);
    CHECK(moved < 1.9);
}

int main(void) {
    refuse_mistakes();
    tell_what_became_of_messages();
    start_away_from_rest();
    redraw_rows();
    printf("all checks passed\n");
    return EXIT_SUCCESS;
}
