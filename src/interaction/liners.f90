! SPDX-License-Identifier: MIT
!> Linings: chains of segments along the wall of an opening (docs/theory.md, "Linings").
!>
!> A segment is a block behind those of the model (`n_segments` of rockdda_model_blocks) that the search for contacts
!> does not find. It moves as a rigid body; its strains, which carry next to nothing, stand for curvature, strain and
!> slope of its back between its node and where the rock holds it: with them a rigid back does not stiffen rock that is
!> finer than the segments. Neighbours are joined by a beam
!> (rockdda_interaction_liner_beam), and the back of each is held to the rock, or to the lining below, at points
!> (rockdda_interaction_liner_ties). The axis of the beams lies in the line of the lining.
!>
!> A joint of two bodies, beam or tie, has a point on each of them, and axes that turn with the mean rotation of both
!> (beam) or with the segment (tie). With D the way from the first point to the second, its change in a step along an
!> axis n is
!>
!>     n1.D1 - n0.D0 = (n1 + n0)/2 . (D1 - D0) + (n1 - n0).(D1 + D0)/2
!>
!> exactly, linear in the unknowns once the rotations in it are those that are expected.
!>
!> Links: four of a beam, along both axes, of the rotation, and along the first axis again for what couples it with the
!> rotation; one of a tie.
module rockdda_interaction_liners
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_base_strings, only : counted, is_given, to_string
   use rockdda_base_value_check, only : value_check_type
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_analysis_input, only : block_material_type
   use rockdda_model_block_names, only : block_name
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_bolt_layout, only : stage_with, rock_at
   use rockdda_model_liner_layout, only : liner_layout_type, new_liner_layout, line_of_liner, title_of_liner, &
      lower_liner, lift, last_below
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name, material_number
   use rockdda_model_stage_options, only : stage_name
   use rockdda_model_state, only : energy, liner_nodes_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_dashpots, only : dashpot_coefficient
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement, &
      end_displacement, new_moved_block
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_linear_anderson, only : anderson_type
   use rockdda_interaction_liner_beam, only : liner_section_type, beam_type, beam_state_type, beam_response_type, &
      new_beam, respond_beam, accept_beam, deformation_of, forces_at, n_sections
   use rockdda_interaction_liner_places, only : stretch_type, find_stretches, follow_rock, faces_of_path, &
      segment_outline, opening_side, reach_over_thickness, rock_ends, &
      block_ends
   use rockdda_interaction_liner_ties, only : tie_type, tie_response_type, tie_numbers, tie_state, respond_tie, &
      pack_tie, unpack_tie
   implicit none
   private
   public :: liners_type, node_state, add_liner_materials

   !> Forces agree with their laws to this share; those of friction, which wait for normal forces.
   real(wp), parameter :: agreement = 1.0e-8_wp, friction_agreement = 1.0e-6_wp
   !> Within a round the misfit of friction and normal forces is brought down by this factor.
   real(wp), parameter :: reduction = 0.03_wp
   !> Rounding of deformations, as a share of them.
   real(wp), parameter :: rounding = 1.0e-13_wp
   !> Stiffness of a bond over E'/thickness of the lining, least and most, and by the third power of thickness over
   !> distance of nodes: a segment of which a half is held does not turn, and its end is clamped.
   real(wp), parameter :: least_bond = 100, most_bond = 1000, bond_of_segment = 120
   !> Modulus of the strains of segments, over that of the lining: of forces that they take from the beams.
   real(wp), parameter :: soft = 1.0e-3_wp
   !> A block along more of a lining than this number of distances of nodes holds each segment at two points.
   real(wp), parameter :: long_block = 2.5_wp
   !> Stretches of a segment below this share of it are none.
   real(wp), parameter :: least_stretch = 1.0e-3_wp
   !> Numbers that last of a beam.
   integer, parameter :: beam_numbers = 6 + 2*n_sections
   integer, parameter :: beam_links = 4

   !> What a node is.
   type :: node_state_enum
      integer :: absent = 0
      integer :: sound = 1
      integer :: cracked = 2
      integer :: crushed = 3
   end type node_state_enum
   type(node_state_enum), parameter :: node_state = node_state_enum()

   !> A beam between two segments, in a step.
   type :: joint_type
      type(beam_type) :: beam
      type(beam_state_type) :: state
      integer :: block(2) = 0          !! segments
      real(wp) :: arm(2, 2) = 0        !! from their centroids to the centre of the beam, as installed [length]
      real(wp) :: d(3) = 0             !! deformation now [length, rad]
      real(wp) :: move(3) = 0, kept(3) = 0   !! its change where forces act
      real(wp) :: at(3) = 0            !! change at which the last round is linear
      type(beam_response_type) :: tangent
   end type joint_type

   type :: liner_type
      character(len=:), allocatable :: name
      integer :: installs = 0, removes = 0       !! stages; 0: from the start, never
      type(liner_layout_type) :: layout          !! on its line at the start
      type(liner_section_type) :: section
      real(wp) :: poisson = 0.2_wp
      real(wp) :: drawn(2) = 0                   !! from the axis towards the opening [length]
      real(wp) :: lift = 0                       !! of its axis from that of the lining below [length]
      integer :: lower = 0                       !! the lining on which it lies; 0: the rock
      integer :: joint = 0                       !! joint material; 0: a bond
      real(wp) :: bond(2) = 0                    !! stiffness of its back over its modulus [1/length]
      real(wp) :: stiffness(2) = 0               !! of its back [force/length^2]
      integer :: before = 0                      !! block before its first segment
      ! what lasts
      logical :: is_there = .false.
      integer :: side = 1                        !! of the path on which the opening lies: 1 left, -1 right
      real(wp), allocatable :: path(:, :)        !! (2, points) as installed [length]
      type(joint_type), allocatable :: joints(:)
      type(tie_type), allocatable :: ties(:)
      integer :: first_link = 0
   end type liner_type

   type, extends(interaction_type) :: liners_type
      type(liner_type), allocatable :: liners(:)
      type(contact_law_type), allocatable :: laws(:)   !! of the joint materials, of the step
      real(wp) :: stored = 0                     !! energy at the end of the last step
      real(wp), private :: level = 1             !! share of the step's motion up to where forces act
      integer, allocatable, private :: sliding(:, :)   !! (2, n) lining and tie of those that slide, in a round
      real(wp), allocatable, private :: friction(:), miss(:)   !! (n) [force]
      real(wp), private :: goal = 0              !! miss of friction that is small enough in the round
      type(anderson_type), private :: acceleration
   contains
      procedure :: init
      procedure :: append_segments
      procedure :: start
      procedure :: begin_stage
      procedure :: n_nodes
      procedure :: show_nodes
      procedure :: stored_energy
      procedure :: count_links
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: add_impulses
      procedure :: tell_changes
      procedure :: begin_friction
      procedure :: improve_friction
      procedure :: predict_sliding
      procedure :: add_friction
      procedure :: predict
      procedure :: keep
      procedure :: shorten
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
      procedure :: check_state
   end type liners_type

contains

   !> Give each lining a block material for its segments, behind all others, unless they have them.
   pure subroutine add_liner_materials(parameters)
      type(parameters_type), intent(inout) :: parameters
      type(block_material_type) :: own
      integer :: k
      if (.not. allocated(parameters%liners)) return
      if (size(parameters%liners) == 0 .or. parameters%first_liner_material > 0) return
      parameters%first_liner_material = size(parameters%block_materials)
      do k = 1, size(parameters%liners)
         associate (liner => parameters%liners(k), first => parameters%block_materials(1))
            own = block_material_type(density=first%density, weight=first%weight, youngs_modulus=soft*liner%young)
            if (is_set(liner%density)) own%density = liner%density
            own%weight = first%weight*(own%density/first%density)
            parameters%block_materials = [parameters%block_materials, own]
         end associate
      end do
   end subroutine add_liner_materials

   !> Poisson's ratio, or that which a lining has by default.
   pure real(wp) function poisson_of(given)
      real(wp), intent(in) :: given
      poisson_of = 0.2_wp
      if (is_set(given)) poisson_of = given
   end function poisson_of

   !> The linings of a model, on their lines as drawn; none is there yet. The context holds the blocks of the model
   !> alone.
   subroutine init(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp), allocatable :: line(:)
      integer :: k, n
      if (allocated(self%liners)) deallocate (self%liners)
      n = 0
      if (allocated(context%parameters%liners)) n = size(context%parameters%liners)
      allocate (self%liners(n))
      self%stored = 0
      n = context%blocks%n_blocks
      associate (p => context%parameters)
         do k = 1, size(self%liners)
            associate (liner => self%liners(k), given => p%liners(k))
               liner%name = title_of_liner(given, k)
               liner%installs = stage_with(p%stages, liner%name, installs=.true.)
               liner%removes = stage_with(p%stages, liner%name, installs=.false.)
               liner%lower = lower_liner(p%liners, k)
               liner%poisson = poisson_of(given%poisson)
               liner%section%thickness = given%thickness
               liner%section%shear = 0.5_wp*(1 - liner%poisson)
               if (is_set(given%compressive_strength)) liner%section%compression = given%compressive_strength
               if (is_set(given%tensile_strength)) liner%section%tension = given%tensile_strength
               liner%drawn = [0.0_wp, given%thickness]
               if (liner%lower > 0) then
                  liner%layout = self%liners(liner%lower)%layout
                  liner%lift = 0.5_wp*(self%liners(liner%lower)%section%thickness + given%thickness)
                  liner%drawn = self%liners(liner%lower)%drawn(2) - liner%lift + [0.0_wp, given%thickness]
               else
                  line = line_of_liner(p%liners, k, context%blocks, p%regions)
                  liner%layout = new_liner_layout(line, given%thickness, given%element)
                  call break_at_rock(context, line, given%element, liner)
               end if
               call set_back(p, given%joint_material, liner)
               call set_young(given%young, liner)
               liner%before = n
               n = n + liner%layout%n
               if (liner%lower > 0) liner%side = self%liners(liner%lower)%side
               allocate (liner%joints(0), liner%ties(0))
               if (liner%layout%n == 0) cycle
               liner%path = liner%layout%path
               if (liner%lower > 0) liner%path = lift(liner%path, liner%layout%closed, liner%side*liner%lift)
            end associate
         end do
      end associate
   end subroutine init

   !> Put nodes where the rock along a line begins or ends when the lining is installed.
   pure subroutine break_at_rock(context, line, element, liner)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: line(:), element
      type(liner_type), intent(inout) :: liner
      type(stretch_type), allocatable :: stretches(:)
      real(wp), allocatable :: ends(:)
      integer :: side
      if (liner%layout%n == 0) return
      associate (p => context%parameters, blocks => context%blocks, t => liner%section%thickness)
         call find_stretches(liner%layout%path, reach_over_thickness*t, blocks, blocks%vertices, &
                             rock_at(blocks, p%regions, p%stages, liner%installs), &
                             stretches, side)
         ends = liner%layout%start + rock_ends(liner%layout%path, stretches, 0.1_wp*t)
         liner%side = merge(side, opening_side(liner%layout%path, liner%layout%closed), side /= 0)
         if (size(stretches) > 0) liner%layout = new_liner_layout(line, t, element, ends, liner%layout%start + &
                                                                  block_ends(liner%layout%path, stretches))
      end associate
   end subroutine break_at_rock

   !> Modulus of a lining, in plane strain, and stiffness of its back.
   pure subroutine set_young(young, liner)
      real(wp), intent(in) :: young
      type(liner_type), intent(inout) :: liner
      call set_modulus(young/(1 - liner%poisson**2), liner)
   end subroutine set_young

   !> The same by the modulus in plane strain.
   pure subroutine set_modulus(modulus, liner)
      real(wp), intent(in) :: modulus
      type(liner_type), intent(inout) :: liner
      liner%section%modulus = modulus
      where (liner%bond > 0) liner%stiffness = modulus*liner%bond
   end subroutine set_modulus

   !> Stiffness of the back, by the modulus or that of its joint material, and that material.
   pure subroutine set_back(parameters, word, liner)
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable, intent(in) :: word
      type(liner_type), intent(inout) :: liner
      integer :: i
      liner%bond = max(least_bond, min(most_bond, bond_of_segment*(liner%section%thickness/mean_distance())**3))/ &
                   liner%section%thickness
      liner%joint = 0
      if (.not. is_given(word)) return
      i = material_number(trim(adjustl(word)))
      if (i >= 1 .and. i <= size(parameters%joint_materials)) liner%joint = i
      do i = 1, size(parameters%joint_materials)
         if (.not. is_given(parameters%joint_materials(i)%name)) cycle
         if (same_name(parameters%joint_materials(i)%name, word)) liner%joint = i
      end do
      if (liner%joint == 0) return
      associate (joint => parameters%joint_materials(liner%joint))
         if (joint%normal_stiffness > 0) liner%stiffness = joint%normal_stiffness
         if (joint%shear_stiffness > 0) liner%stiffness(2) = joint%shear_stiffness
      end associate
      where (liner%stiffness > 0) liner%bond = 0

   contains

      !> Mean distance of the nodes.
      pure real(wp) function mean_distance()
         integer :: k
         mean_distance = liner%section%thickness
         if (liner%layout%n < 2) return
         mean_distance = sum([(norm2(liner%layout%path(:, k + 1) - liner%layout%path(:, k)), &
                               k=1, size(liner%layout%path, 2) - 1)])/merge(liner%layout%n, &
                        liner%layout%n - 1, liner%layout%closed)
      end function mean_distance

   end subroutine set_back

   !> Append the segments of all linings, absent, to blocks and state.
   subroutine append_segments(self, context)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      integer :: b, i, k, n, at
      if (n_liners(self) == 0) return
      n = self%n_nodes()
      at = 0
      do k = 1, n_liners(self)
         do i = 1, self%liners(k)%layout%n
            at = at + 2*(self%liners(k)%layout%last(i) - self%liners(k)%layout%first(i) + 1)
         end do
      end do
      associate (blocks => context%blocks)
         b = blocks%n_blocks
         blocks%vertices = columns(blocks%vertices, zeros(2, at))
         at = blocks%vertex_offset(b + 1)
         blocks%edge_joint = [blocks%edge_joint, spread(0, 1, size(blocks%vertices, 2) - at)]
         blocks%vertex_offset = [blocks%vertex_offset, spread(0, 1, n)]
         blocks%block_material = [blocks%block_material, spread(0, 1, n)]
         if (allocated(blocks%file_line)) blocks%file_line = [blocks%file_line, spread(0, 1, n)]
         if (allocated(blocks%parent)) blocks%parent = [blocks%parent, (i, i=b + 1, b + n)]
         blocks%n_blocks = b + n
         do k = 1, n_liners(self)
            associate (liner => self%liners(k), layout => self%liners(k)%layout)
               if (layout%n == 0) cycle
               associate (faces => faces_of_path(liner%path, layout%closed, liner%side, liner%drawn))
                  do i = 1, layout%n
                     b = b + 1
                     associate (outline => segment_outline(faces, layout%first(i), layout%last(i), liner%side))
                        blocks%vertices(:, at + 1:at + size(outline, 2)) = outline
                        at = at + size(outline, 2)
                     end associate
                     blocks%vertex_offset(b + 1) = at
                     blocks%block_material(b) = context%parameters%first_liner_material + k
                  end do
               end associate
            end associate
         end do
      end associate
      associate (blocks => context%blocks, state => context%state)
         blocks%n_segments = n
         state%vertices = blocks%vertices
         state%centroid = columns(state%centroid, zeros(2, n))
         state%rotation = [state%rotation, spread(0.0_wp, 1, n)]
         state%stress = columns(state%stress, zeros(3, n))
         state%velocity = columns(state%velocity, zeros(6, n))
         state%acceleration = columns(state%acceleration, zeros(6, n))
         state%area = [state%area, spread(0.0_wp, 1, n)]
         state%moments = columns(state%moments, zeros(3, n))
         state%mass = [state%mass, spread(0.0_wp, 1, n)]
         state%active = [state%active, spread(.false., 1, n)]
         state%asleep = [state%asleep, spread(.false., 1, n)]
         state%calm = [state%calm, spread(0, 1, n)]
         if (allocated(context%held)) context%held = [context%held, spread(.false., 1, n)]
         ! blocks beside a lining do not sleep
         if (allocated(context%bolted)) deallocate (context%bolted)
         allocate (context%bolted(blocks%n_blocks), source=.true.)
         do i = blocks%n_blocks - n + 1, blocks%n_blocks
            call set_properties(context, i)
         end do
         associate (field => context%initial_stress)
            if (allocated(field%stress)) then
               field%stress = columns(field%stress, zeros(3, n))
               field%gradient = reshape([field%gradient, zeros(6, n)], [3, 2, blocks%n_blocks])
               field%centroid = state%centroid
            end if
         end associate
      end associate
   end subroutine append_segments

   !> Two tables side by side.
   pure function columns(a, b) result(both)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: both(size(a, 1), size(a, 2) + size(b, 2))
      both(:, :size(a, 2)) = a
      both(:, size(a, 2) + 1:) = b
   end function columns

   !> A table of zeros.
   pure function zeros(m, n)
      integer, intent(in) :: m, n
      real(wp) :: zeros(m, n)
      zeros = 0
   end function zeros

   !> Area, centroid, moments and mass of a segment, by its outline.
   subroutine set_properties(context, i)
      type(step_context_type), intent(inout) :: context
      integer, intent(in) :: i       !! block
      associate (state => context%state, blocks => context%blocks)
         call polygon_properties(state%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                                 state%area(i), state%centroid(:, i), state%moments(:, i))
         state%mass(i) = context%parameters%block_materials(blocks%block_material(i))%density*state%area(i)
      end associate
   end subroutine set_properties

   !> Relative to the datum of the run; linings that are there from the start are installed.
   subroutine start(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      integer :: k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (liner%layout%n == 0) cycle
            liner%layout%path = liner%layout%path - spread(context%state%datum, 2, size(liner%layout%path, 2))
            liner%path = liner%path - spread(context%state%datum, 2, size(liner%path, 2))
         end associate
      end do
      do k = 1, n_liners(self)
         if (self%liners(k)%installs == 0) call install(self, k, context)
      end do
   end subroutine start

   !> Install a lining on the deformed outline, free of stress.
   subroutine install(self, k, context)
      class(liners_type), intent(inout) :: self
      integer, intent(in) :: k
      type(step_context_type), intent(inout) :: context
      type(stretch_type), allocatable :: stretches(:)
      real(wp), allocatable :: faces(:, :, :)
      real(wp) :: reach
      integer :: b, i, side
      associate (liner => self%liners(k), layout => self%liners(k)%layout, state => context%state)
         if (layout%n == 0) return
         if (liner%lower > 0) then
            if (.not. self%liners(liner%lower)%is_there) return
            liner%side = self%liners(liner%lower)%side
            liner%path = lift(path_now(context, self%liners(liner%lower)), layout%closed, liner%side*liner%lift)
            allocate (stretches(0))
         else
            reach = reach_over_thickness*liner%section%thickness
            liner%path = follow_rock(layout%path, reach, context%blocks, state%vertices, state%active)
            if (layout%closed) liner%path(:, size(liner%path, 2)) = liner%path(:, 1)
            call find_stretches(liner%path, reach, context%blocks, state%vertices, state%active, stretches, side)
            liner%side = opening_side(liner%path, layout%closed)
            if (side /= 0) liner%side = side
         end if
         liner%is_there = .true.
         faces = faces_of_path(liner%path, layout%closed, liner%side, liner%drawn)
         do i = 1, layout%n
            b = liner%before + i
            state%vertices(:, context%blocks%vertex_offset(b) + 1:context%blocks%vertex_offset(b + 1)) = &
               segment_outline(faces, layout%first(i), layout%last(i), liner%side)
            call set_properties(context, b)
            state%rotation(b) = 0
            state%velocity(:, b) = 0
            state%acceleration(:, b) = 0
            state%stress(:, b) = 0
            state%active(b) = .true.
         end do
         call join_segments(liner)
         if (liner%lower > 0) then
            call tie_to_lining(context, self%liners(liner%lower), liner)
         else
            call tie_to_rock(context, stretches, liner)
         end if
      end associate
   end subroutine install

   !> Where the path of a lining that is there lies now, by its segments; at the end of two of them half-way between.
   pure function path_now(context, liner) result(path)
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      real(wp), allocatable :: path(:, :), center(:, :)
      integer :: i, n(size(liner%path, 2)), p
      allocate (path, mold=liner%path)
      path = 0
      n = 0
      center = installed_centroids(liner)
      do i = 1, liner%layout%n
         do p = liner%layout%first(i), liner%layout%last(i)
            path(:, p) = path(:, p) + on_segment(context, liner%before + i, liner%path(:, p) - center(:, i))
            n(p) = n(p) + 1
         end do
      end do
      path = path/spread(n, 1, 2)
      if (.not. liner%layout%closed) return
      p = size(path, 2)
      path(:, 1) = 0.5_wp*(path(:, 1) + path(:, p))
      path(:, p) = path(:, 1)
   end function path_now

   !> Centroids that the segments had when they were installed.
   pure function installed_centroids(liner) result(center)
      type(liner_type), intent(in) :: liner
      real(wp) :: center(2, liner%layout%n), area, moments(3)
      real(wp) :: faces(2, size(liner%path, 2), 2)
      integer :: i
      faces = faces_of_path(liner%path, liner%layout%closed, liner%side, liner%drawn)
      do i = 1, liner%layout%n
         call polygon_properties(segment_outline(faces, liner%layout%first(i), liner%layout%last(i), liner%side), &
                                 area, center(:, i), moments)
      end do
   end function installed_centroids

   !> A point of a segment now, given its arm when the segment was installed.
   pure function on_segment(context, block, arm) result(point)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp), intent(in) :: arm(2)
      real(wp) :: point(2)
      point = context%state%centroid(:, block) + turned(arm, context%state%rotation(block))
   end function on_segment

   !> A vector turned by an angle.
   pure function turned(v, angle)
      real(wp), intent(in) :: v(2), angle
      real(wp) :: turned(2)
      turned = [cos(angle)*v(1) - sin(angle)*v(2), sin(angle)*v(1) + cos(angle)*v(2)]
   end function turned

   !> Beams between all neighbours, on the path as installed.
   pure subroutine join_segments(liner)
      type(liner_type), intent(inout) :: liner
      real(wp) :: center(2, liner%layout%n)
      real(wp), allocatable :: path(:, :)
      integer :: i, next, n
      if (allocated(liner%joints)) deallocate (liner%joints)
      n = liner%layout%n
      allocate (liner%joints(merge(n, n - 1, liner%layout%closed)))
      center = installed_centroids(liner)
      do i = 1, size(liner%joints)
         next = 1 + mod(i, n)
         if (next > i) then
            path = liner%path(:, liner%layout%node(i):liner%layout%node(next))
         else
            path = columns(liner%path(:, liner%layout%node(i):), liner%path(:, 2:liner%layout%node(1)))
         end if
         associate (joint => liner%joints(i))
            joint%beam = new_beam(path, liner%section, liner%side)
            joint%block = liner%before + [i, next]
            joint%arm(:, 1) = joint%beam%center - center(:, i)
            joint%arm(:, 2) = joint%beam%center - center(:, next)
         end associate
      end do
   end subroutine join_segments

   !> Hold the back to the rock: in the middle of the part of a segment along each block; along a block far longer than
   !> segments, or without another one beside it, at two points. The back may strain between its node and the points,
   !> take its own slope beside two small blocks, and bend beside three: a surface of small blocks has steps, which are
   !> no rotation of the lining.
   subroutine tie_to_rock(context, stretches, liner)
      type(step_context_type), intent(in) :: context
      type(stretch_type), intent(in) :: stretches(:)
      type(liner_type), intent(inout) :: liner
      type(tie_type) :: tie
      real(wp) :: s(size(liner%path, 2)), ends(2, size(stretches)), whole(size(stretches)), along(2), normal(2)
      real(wp) :: from, to, at, half, node, usual
      integer :: g, i, j, n, n_ties, of(size(stretches)), block(size(stretches)), piece(size(liner%path, 2))
      integer :: parts(0:liner%layout%n), first(liner%layout%n + 1)
      logical :: alone
      if (allocated(liner%ties)) deallocate (liner%ties)
      allocate (liner%ties(2*size(stretches)))
      n_ties = 0
      do i = 1, liner%layout%n
         piece(liner%layout%first(i):liner%layout%last(i) - 1) = i
      end do
      s(1) = 0
      do i = 2, size(s)
         s(i) = s(i - 1) + norm2(liner%path(:, i) - liner%path(:, i - 1))
      end do
      usual = s(size(s))/size(liner%joints)
      ! one part for each block and segment
      n = 0
      do j = 1, size(stretches)
         associate (k => stretches(j)%piece)
            from = s(k) + stretches(j)%ends(1)*(s(k + 1) - s(k))
            to = s(k) + stretches(j)%ends(2)*(s(k + 1) - s(k))
            i = piece(k)
         end associate
         if (n > 0) then
            if (block(n) == stretches(j)%block .and. of(n) == i .and. from - ends(2, n) < least_stretch*usual) then
               ends(2, n) = to
               cycle
            end if
         end if
         n = n + 1
         ends(:, n) = [from, to]
         block(n) = stretches(j)%block
         of(n) = i
      end do
      do j = 1, n
         whole(j) = ends(2, j) - ends(1, j)
         if (j == 1) cycle
         if (block(j) == block(j - 1) .and. ends(1, j) - ends(2, j - 1) < least_stretch*usual) &
            whole(j) = whole(j) + whole(j - 1)
      end do
      do j = n - 1, 1, -1
         if (block(j) == block(j + 1) .and. ends(1, j + 1) - ends(2, j) < least_stretch*usual) whole(j) = whole(j + 1)
      end do
      where (ends(2, :n) - ends(1, :n) < least_stretch*usual) of(:n) = 0
      parts = 0
      do j = 1, n
         parts(of(j)) = parts(of(j)) + 1
      end do
      do j = 1, n
         if (of(j) == 0) cycle
         half = 0.5_wp*(ends(2, j) - ends(1, j))
         node = s(liner%layout%node(of(j)))
         along = point_at(ends(2, j)) - point_at(ends(1, j))
         normal = liner%side*[-along(2), along(1)]
         tie%a = block(j)
         tie%b = liner%before + of(j)
         tie%angle = atan2(normal(2), normal(1))
         alone = whole(j) > long_block*usual .or. .not. has_neighbour(j)
         tie%length = merge(half, 2*half, alone)
         do g = merge(-1, 1, alone), 1, 2
            at = 0.5_wp*sum(ends(:, j)) + merge(g*half/sqrt(3.0_wp), 0.0_wp, alone)
            tie%at_a = point_at(at)
            tie%arm = tie%at_a - context%state%centroid(:, tie%b)
            tie%shape = [(at - node)**2/liner%section%thickness, -liner%side*(at - node), at - node]
            if (alone) then
               tie%shape([1, 3]) = 0
            else
               if (parts(of(j)) < 3) tie%shape(1) = 0
               if (parts(of(j)) < 2) tie%shape = 0
            end if
            n_ties = n_ties + 1
            liner%ties(n_ties) = tie
         end do
      end do
      liner%ties = liner%ties(:n_ties)
      ! ties of a segment follow each other
      first = 0
      do j = 1, n_ties
         i = liner%ties(j)%b - liner%before
         if (first(i) == 0) first(i) = j
      end do
      first(liner%layout%n + 1) = n_ties + 1
      do i = liner%layout%n, 1, -1
         if (first(i) == 0) first(i) = first(i + 1)
         call center_shapes([(j, j=first(i), first(i + 1) - 1)])
      end do

   contains

      !> The shapes of a back have no mean: uniform pressure and shear do not change it.
      subroutine center_shapes(mine)
         integer, intent(in) :: mine(:)
         logical :: has(size(mine))
         integer :: k
         associate (ties => liner%ties)
            do k = 1, 3
               has = abs(ties(mine)%shape(k)) > 0
               if (.not. any(has)) cycle
               where (has) ties(mine)%shape(k) = ties(mine)%shape(k) - sum(ties(mine)%shape(k)*ties(mine)%length, &
                                                                          has)/sum(ties(mine)%length, has)
            end do
         end associate
      end subroutine center_shapes

      !> Does another block lie along the lining beside this one?
      pure logical function has_neighbour(j)
         integer, intent(in) :: j
         integer :: i
         has_neighbour = .false.
         do i = j + 1, n
            if (ends(1, i) - ends(2, j) >= 0.1_wp*usual .or. has_neighbour) exit
            has_neighbour = block(i) /= block(j)
         end do
         do i = j - 1, 1, -1
            if (ends(1, j) - ends(2, i) >= 0.1_wp*usual .or. has_neighbour) exit
            has_neighbour = block(i) /= block(j)
         end do
      end function has_neighbour

      !> Point of the path at a distance from its start.
      pure function point_at(distance) result(x)
         real(wp), intent(in) :: distance
         real(wp) :: x(2), share
         integer :: k
         k = max(1, min(size(s) - 1, last_below(distance, s)))
         share = max(0.0_wp, min(1.0_wp, (distance - s(k))/max(s(k + 1) - s(k), tiny(1.0_wp))))
         x = liner%path(:, k) + share*(liner%path(:, k + 1) - liner%path(:, k))
      end function point_at

   end subroutine tie_to_rock

   !> Hold a layer to the segments below, at their common face.
   subroutine tie_to_lining(context, lower, liner)
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: lower
      type(liner_type), intent(inout) :: liner
      type(tie_type) :: tie
      real(wp) :: face(2, size(liner%path, 2)), along(2), x(2), normal(2)
      integer :: g, i, n, p
      if (allocated(liner%ties)) deallocate (liner%ties)
      allocate (liner%ties(2*size(face, 2)))
      n = 0
      face = lift(liner%path, liner%layout%closed, -0.5_wp*liner%side*liner%section%thickness)
      tie%on_rock = .false.
      do i = 1, liner%layout%n
         do p = liner%layout%first(i), liner%layout%last(i) - 1
            along = face(:, p + 1) - face(:, p)
            if (.not. norm2(along) > 0) cycle
            normal = liner%side*[-along(2), along(1)]/norm2(along)
            do g = -1, 1, 2
               x = face(:, p) + 0.5_wp*(1 + g/sqrt(3.0_wp))*along
               tie%a = lower%before + i
               tie%b = liner%before + i
               tie%at_a = turned(x - context%state%centroid(:, tie%a), -context%state%rotation(tie%a))
               tie%arm = x - context%state%centroid(:, tie%b)
               tie%angle = atan2(normal(2), normal(1))
               tie%length = 0.5_wp*norm2(along)
               n = n + 1
               liner%ties(n) = tie
            end do
         end do
      end do
      liner%ties = liner%ties(:n)
   end subroutine tie_to_lining

   !> Remove and install linings when a stage begins, and take new moduli, under which stress stays. What has gone is
   !> discarded.
   subroutine begin_stage(self, stage, context, balance)
      class(liners_type), intent(inout) :: self
      integer, intent(in) :: stage
      type(step_context_type), intent(inout) :: context
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: left, kinetic
      integer :: b, i, k, l
      if (n_liners(self) == 0) return
      kinetic = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (liner%removes == stage .and. liner%is_there) then
               liner%is_there = .false.
               do b = liner%before + 1, liner%before + liner%layout%n
                  kinetic = kinetic + 0.5_wp*dot_product(context%state%velocity(:, b), &
                                                         context%momentum(b, context%state%velocity(:, b)))
                  context%state%active(b) = .false.
                  context%state%velocity(:, b) = 0
                  context%state%acceleration(:, b) = 0
                  context%state%stress(:, b) = 0
               end do
            end if
            ! rock that goes, and comes back as it was drawn, is no longer behind the lining
            do l = 1, size(liner%ties)
               if (liner%ties(l)%a == 0) cycle
               if (.not. context%state%active(liner%ties(l)%a)) liner%ties(l)%a = 0
            end do
            do i = 1, size(context%parameters%changes)
               associate (change => context%parameters%changes(i))
                  if (.not. (is_given(change%liner) .and. is_set(change%young) .and. is_given(change%stage))) cycle
                  if (.not. same_name(change%liner, liner%name)) cycle
                  if (.not. same_name(change%stage, stage_name(context%parameters%stages, stage))) cycle
                  call harden(self, context, change%young, liner)
               end associate
            end do
         end associate
      end do
      left = self%stored_energy(context)
      call balance%add(energy%discarded, kinetic + self%stored - left)
      self%stored = left
      do k = 1, n_liners(self)
         if (self%liners(k)%installs == stage) call install(self, k, context)
      end do
   end subroutine begin_stage

   !> A new Young's modulus under which all forces stay.
   subroutine harden(self, context, young, liner)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: young
      type(liner_type), intent(inout) :: liner
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie(size(liner%ties))
      type(liner_section_type) :: old
      integer :: i
      old = liner%section
      do i = 1, size(liner%ties)
         call respond(self, liner, liner%ties(i), liner%ties(i)%motion, of_tie(i))
      end do
      call set_young(young, liner)
      if (.not. liner%is_there) return
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i), k => liner%stiffness*liner%ties(i)%length, of => of_tie(i))
            if (.not. acts(context, tie)) cycle
            if (of%state == tie_state%held .or. of%state == tie_state%slides) &
               tie%free(1) = tie%motion(1) - of%force(1)/k(1)
            tie%free(2) = tie%motion(2) - of%force(2)/k(2)
         end associate
      end do
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, old, joint%state, joint%d, response)
            joint%state%free = joint%d - deformation_of(joint%beam, liner%section, joint%state, response%f)
         end associate
      end do
   end subroutine harden

   !> Deformation of a beam after a motion of its segments, from the present one: what changes is found from what moves,
   !> so that it has the digits of the motion.
   pure function moved_beam(context, joint, d) result(deformation)
      type(step_context_type), intent(in) :: context
      type(joint_type), intent(in) :: joint
      real(wp), intent(in), contiguous :: d(:, :)    !! (6, nb)
      real(wp) :: deformation(3), way(2), angle
      associate (a => joint%block(1), b => joint%block(2))
         angle = joint%beam%angle + 0.5_wp*(context%state%rotation(a) + context%state%rotation(b))
         way = turned(joint%d(1:2), angle) + (arm_motion(context, b, joint%arm(:, 2), d) - &
                                              arm_motion(context, a, joint%arm(:, 1), d))
         deformation(1:2) = along(angle + 0.5_wp*(d(3, a) + d(3, b)), way)
         deformation(3) = joint%d(3) + (d(3, b) - d(3, a))
      end associate
   end function moved_beam

   !> Gap and shear displacement of a tie after a motion.
   pure function moved_tie(context, tie, d) result(motion)
      type(step_context_type), intent(in) :: context
      type(tie_type), intent(in) :: tie
      real(wp), intent(in), contiguous :: d(:, :)    !! (6, nb)
      real(wp) :: motion(2), way(2), of_a(2), angle
      angle = tie%angle + context%state%rotation(tie%b)
      if (tie%on_rock) then
         of_a = end_displacement(new_moved_block(context%state%centroid(:, tie%a), d(:, tie%a), &
                                                 context%parameters%exact_rotation), tie%at_a)
      else
         of_a = arm_motion(context, tie%a, tie%at_a, d)
      end if
      way = turned(tie%motion - tie%bent, angle) + (arm_motion(context, tie%b, tie%arm, d) - of_a)
      motion = along(angle + d(3, tie%b), way) + (tie%bent + by_shape(tie, d(4:6, tie%b)))
   end function moved_tie

   !> Displacement of a point of a segment.
   pure function arm_motion(context, b, arm, d) result(u)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: b
      real(wp), intent(in) :: arm(2)                 !! as installed [length]
      real(wp), intent(in), contiguous :: d(:, :)    !! (6, nb)
      real(wp) :: u(2), v(2)
      v = turned(arm, context%state%rotation(b) + 0.5_wp*d(3, b))
      u = d(1:2, b) + 2*sin(0.5_wp*d(3, b))*[-v(2), v(1)]
   end function arm_motion

   !> Components of a vector along two axes.
   pure function along(angle, v)
      real(wp), intent(in) :: angle, v(2)
      real(wp) :: along(2)
      along = turned(v, -angle)
   end function along

   !> The point of a tie on its first body, now.
   pure function first_point(context, tie) result(x)
      type(step_context_type), intent(in) :: context
      type(tie_type), intent(in) :: tie
      real(wp) :: x(2)
      if (tie%on_rock) then
         x = tie%at_a
      else
         x = on_segment(context, tie%a, tie%at_a)
      end if
   end function first_point

   !> Gap and shear displacement by the shape of the back.
   pure function by_shape(tie, shape) result(d)
      type(tie_type), intent(in) :: tie
      real(wp), intent(in) :: shape(3)
      real(wp) :: d(2)
      d = [tie%shape(1)*shape(1) + tie%shape(3)*shape(3), tie%shape(2)*shape(2)]
   end function by_shape

   !> Does a tie act?
   pure logical function acts(context, tie)
      type(step_context_type), intent(in) :: context
      type(tie_type), intent(in) :: tie
      acts = tie%a > 0
      if (acts) acts = context%state%active(tie%a) .and. context%state%active(tie%b)
   end function acts

   !> Energy of all linings in the present state.
   pure real(wp) function stored_energy(self, context) result(stored)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      integer :: i, k
      stored = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               call respond_beam(liner%joints(i)%beam, liner%section, liner%joints(i)%state, &
                                 liner%joints(i)%d, response)
               stored = stored + response%energy
            end do
            do i = 1, size(liner%ties)
               if (.not. acts(context, liner%ties(i))) cycle
               call respond(self, liner, liner%ties(i), liner%ties(i)%motion, of_tie)
               stored = stored + of_tie%energy
            end do
         end associate
      end do
   end function stored_energy

   !> Forces of a tie.
   pure subroutine respond(self, liner, tie, motion, response)
      class(liners_type), intent(in) :: self
      type(liner_type), intent(in) :: liner
      type(tie_type), intent(in) :: tie
      real(wp), intent(in) :: motion(2)
      type(tie_response_type), intent(out) :: response
      if (liner%joint > 0 .and. allocated(self%laws)) then
         call respond_tie(tie, liner%stiffness, motion, response, self%laws(liner%joint))
      else
         call respond_tie(tie, liner%stiffness, motion, response)
      end if
   end subroutine respond

   !> Number of linings; before `init` there are none.
   pure integer function n_liners(self)
      class(liners_type), intent(in) :: self
      n_liners = 0
      if (allocated(self%liners)) n_liners = size(self%liners)
   end function n_liners

   !> Nodes of all linings.
   pure integer function n_nodes(self) result(n)
      class(liners_type), intent(in) :: self
      integer :: k
      n = 0
      if (.not. allocated(self%liners)) return
      do k = 1, n_liners(self)
         n = n + self%liners(k)%layout%n
      end do
   end function n_nodes

   !> Place, forces and state of all nodes; forces at a node are the mean of those of both beams. The moment there is
   !> that of a pressure along the segments, not of forces at their nodes: less by q l^2/12. Around a closed line the
   !> part N t^2/(12 R) that the mean of N has about the centroid is left out, as in the theory of thin rings.
   pure subroutine show_nodes(self, context, nodes)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(liner_nodes_type), intent(out) :: nodes
      type(beam_response_type) :: response
      real(wp), allocatable :: center(:, :), sum_of(:), eccentricity(:), pressure(:)
      real(wp) :: of_ends(3, 2), share(2)
      logical, allocatable :: held(:)
      integer :: i, k, n, next
      allocate (nodes%place(2, self%n_nodes()), nodes%force(3, self%n_nodes()), sum_of(self%n_nodes()), &
                eccentricity(self%n_nodes()), source=0.0_wp)
      allocate (nodes%state(self%n_nodes()), source=node_state%absent)
      n = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k), layout => self%liners(k)%layout)
            if (liner%is_there) then
               center = installed_centroids(liner)
               pressure = pressures(self, context, liner)
               held = spread(.false., 1, layout%n)
               held(pack(liner%ties%b, liner%ties%a > 0) - liner%before) = .true.
               do i = 1, layout%n
                  nodes%place(:, n + i) = on_segment(context, liner%before + i, liner%path(:, layout%node(i)) - &
                                                     center(:, i))
                  nodes%state(n + i) = node_state%sound
               end do
               do i = 1, size(liner%joints)
                  associate (joint => liner%joints(i))
                     call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
                     next = n + 1 + mod(i, layout%n)
                     of_ends(:, 1) = forces_at(joint%beam, response%f, 1)
                     of_ends(:, 2) = forces_at(joint%beam, response%f, n_sections)
                     if (all(held(joint%block - liner%before))) of_ends(2, :) = of_ends(2, :) - &
                        joint%beam%length**2/12*0.5_wp*sum(pressure(joint%block - liner%before))
                     eccentricity([n + i, next]) = eccentricity([n + i, next]) + joint%beam%eccentricity
                     share = shares(joint%block - liner%before, held, layout%closed)
                     nodes%force(:, n + i) = nodes%force(:, n + i) + share(1)*of_ends(:, 1)
                     nodes%force(:, next) = nodes%force(:, next) + share(2)*of_ends(:, 2)
                     sum_of([n + i, next]) = sum_of([n + i, next]) + share
                     nodes%state(n + i) = max(nodes%state(n + i), state_of(joint%state, 1))
                     nodes%state(next) = max(nodes%state(next), state_of(joint%state, n_sections))
                  end associate
               end do
            else
               do i = 1, layout%n
                  nodes%place(:, n + i) = liner%path(:, layout%node(i))
               end do
            end if
            n = n + layout%n
         end associate
      end do
      nodes%force = nodes%force/spread(max(1.0_wp, sum_of), 1, 3)
      eccentricity = 0.5_wp*eccentricity
      n = 0
      do k = 1, n_liners(self)
         associate (layout => self%liners(k)%layout)
            if (layout%closed) nodes%force(2, n + 1:n + layout%n) = nodes%force(2, n + 1:n + layout%n) - &
               eccentricity(n + 1:n + layout%n)*sum(nodes%force(1, n + 1:n + layout%n))/layout%n
            n = n + layout%n
         end associate
      end do

   contains

      !> Shares of the beam of two segments in the forces of their nodes: none where rock ends at the node on the side
      !> of the beam, for a clamped end is that of the free side.
      pure function shares(pair, held, closed) result(share)
         integer, intent(in) :: pair(2)
         logical, intent(in) :: held(:), closed
         real(wp) :: share(2)
         integer :: beyond(2)
         beyond = [pair(1) - 1, pair(2) + 1]
         if (closed) beyond = 1 + modulo(beyond - 1, size(held))
         share = 1
         if (beyond(1) >= 1) then
            if (held(pair(2)) .and. .not. held(beyond(1))) share(1) = 0
         end if
         if (beyond(2) <= size(held)) then
            if (held(pair(1)) .and. .not. held(beyond(2))) share(2) = 0
         end if
      end function shares

      !> What a section is.
      pure integer function state_of(state, section)
         type(beam_state_type), intent(in) :: state
         integer, intent(in) :: section
         state_of = node_state%sound
         if (state%cracked(section)) state_of = node_state%cracked
         if (state%crushed(section)) state_of = node_state%crushed
      end function state_of

   end subroutine show_nodes

   !> Pressure on the back of each segment, towards the opening.
   pure function pressures(self, context, liner) result(pressure)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      real(wp) :: pressure(liner%layout%n), length(liner%layout%n)
      type(tie_response_type) :: response
      integer :: i, k
      pressure = 0
      do k = 1, size(liner%ties)
         associate (tie => liner%ties(k))
            if (.not. acts(context, tie)) cycle
            call respond(self, liner, tie, tie%motion, response)
            pressure(tie%b - liner%before) = pressure(tie%b - liner%before) - response%force(1)
         end associate
      end do
      length = 0
      do i = 1, size(liner%joints)
         associate (both => liner%joints(i)%block - liner%before)
            length(both) = length(both) + 0.5_wp*liner%joints(i)%beam%length
         end associate
      end do
      pressure = pressure/max(length, tiny(1.0_wp))
   end function pressures

   !> Links of one lining.
   pure integer function links_of(liner) result(n)
      type(liner_type), intent(in) :: liner
      n = 0
      if (liner%is_there) n = beam_links*size(liner%joints) + size(liner%ties)
   end function links_of

   !> Four of a beam, one of a tie.
   pure integer function count_links(self, context) result(n)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer :: k
      associate (unused => context%dt)
      end associate
      n = 0
      do k = 1, n_liners(self)
         n = n + links_of(self%liners(k))
      end do
   end function count_links

   !> Deformations at the start of the step.
   subroutine prepare(self, context, equations)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer :: c, i, k, l
      c = self%first_link
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            liner%first_link = c
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               do l = 1, beam_links
                  call equations%join(c + l, liner%joints(i)%block)
               end do
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  tie%acts = acts(context, tie)
                  c = c + 1
                  call equations%join(c, merge([tie%a, tie%b], 0, tie%acts))
               end associate
            end do
         end associate
      end do
   end subroutine prepare

   !> Begin an attempt: linear at the start of the step.
   subroutine begin(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      integer :: changes, k, unsettled
      self%level = context%scheme%level
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            call rest(liner)
         end associate
      end do
      call set_levels(self, context)
      call set_dashpots(self, context)
      call self%judge(changes, unsettled)
      do k = 1, n_liners(self)
         self%liners(k)%ties%changes = 0
      end do

   contains

      !> No motion.
      pure subroutine rest(liner)
         type(liner_type), intent(inout) :: liner
         integer :: i
         do i = 1, size(liner%joints)
            liner%joints(i)%move = 0
         end do
         do i = 1, size(liner%ties)
            liner%ties(i)%move = 0
         end do
      end subroutine rest

   end subroutine begin

   !> Where in the step ties act. One that is open at the start and closes does not know when: its force at the end is
   !> an impulse (rockdda_interaction_time_scheme), or it would give energy.
   subroutine set_levels(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(tie_response_type) :: at_start
      integer :: i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            liner%ties%level = self%level
            liner%ties%factor = 1
            if (liner%joint == 0 .or. .not. context%scheme%second_order) cycle
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call respond(self, liner, tie, tie%motion, at_start)
                  if (at_start%state /= tie_state%open) cycle
                  tie%level = 1
                  tie%factor = context%scheme%impact
               end associate
            end do
         end associate
      end do
   end subroutine set_levels

   !> Begin a search, while all states stay as they are, for friction forces that agree with the normal forces that they
   !> cause: as for contacts (rockdda_interaction_friction_search).
   subroutine begin_friction(self)
      class(liners_type), intent(inout) :: self
      integer :: i, k, n, pass
      do pass = 1, 2
         n = 0
         do k = 1, n_liners(self)
            if (self%liners(k)%joint == 0 .or. .not. self%liners(k)%is_there) cycle
            do i = 1, size(self%liners(k)%ties)
               associate (tie => self%liners(k)%ties(i))
                  if (.not. (tie%acts .and. (tie%state == tie_state%slides .or. tie%state == tie_state%parts))) cycle
                  n = n + 1
                  if (pass == 2) self%sliding(:, n) = [k, i]
               end associate
            end do
         end do
         if (pass == 2) exit
         if (allocated(self%sliding)) deallocate (self%sliding, self%friction, self%miss)
         allocate (self%sliding(2, n), self%friction(n), self%miss(n))
      end do
      call self%acceleration%restart(n)
      self%goal = -1
   end subroutine begin_friction

   !> Compare the friction forces of the last solve with the limits at its motion, and replace them by a better guess.
   !> It is enough when they miss the limits by far less than at first, or than a round accepts.
   subroutine improve_friction(self, to_end, is_enough)
      class(liners_type), intent(inout) :: self
      logical, intent(in) :: to_end          !! as well as a round must be accepted
      logical, intent(out) :: is_enough
      type(tie_response_type) :: of_tie
      real(wp) :: worst, largest
      integer :: i, k, n
      is_enough = .true.
      n = 0
      if (allocated(self%sliding)) n = size(self%friction)
      if (n == 0) return
      worst = 0
      largest = 0
      do i = 1, n
         k = self%sliding(1, i)
         associate (tie => self%liners(k)%ties(self%sliding(2, i)))
            if (i == 1) then
               largest = largest_pressure(self%liners(k))
            else if (k /= self%sliding(1, i - 1)) then
               largest = largest_pressure(self%liners(k))
            end if
            call respond(self, self%liners(k), tie, tie%motion + tie%move, of_tie)
            self%friction(i) = abs(tie%force(2))
            self%miss(i) = of_tie%limit - self%friction(i)
            worst = max(worst, abs(self%miss(i))/max(tiny(1.0_wp), self%friction(i), tie%length*largest))
         end associate
      end do
      if (self%goal < 0) self%goal = max(reduction*worst, 0.5_wp*friction_agreement)
      is_enough = worst <= merge(0.5_wp*friction_agreement, self%goal, to_end)
      if (is_enough) return
      call self%acceleration%next(self%friction, self%miss)
      do i = 1, n
         associate (tie => self%liners(self%sliding(1, i))%ties(self%sliding(2, i)))
            tie%force(2) = sign(max(0.0_wp, self%friction(i)), tie%force(2))
         end associate
      end do
   end subroutine improve_friction

   !> Largest normal force over length of the ties of a lining, in the last judgement.
   pure real(wp) function largest_pressure(liner) result(largest)
      type(liner_type), intent(in) :: liner
      integer :: i
      largest = 0
      do i = 1, size(liner%ties)
         if (liner%ties(i)%acts) largest = max(largest, abs(liner%ties(i)%force(1))/liner%ties(i)%length)
      end do
   end function largest_pressure

   !> The friction forces alone, where all states are those of the last solve.
   subroutine add_friction(self, equations)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: i, l
      if (.not. allocated(self%sliding)) return
      do i = 1, size(self%friction)
         associate (liner => self%liners(self%sliding(1, i)), tie => self%liners(self%sliding(1, i))% &
                    ties(self%sliding(2, i)))
            l = liner%first_link + beam_links*size(liner%joints) + self%sliding(2, i)
            call equations%set_link(l, equations%stiffness(:, l), [equations%force(1, l), -tie%factor*tie%force(2)])
         end associate
      end do
   end subroutine add_friction

   !> Motion of the ties that slide, for new friction forces.
   subroutine predict_sliding(self, equations)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      real(wp) :: motion(2)
      integer :: i
      if (.not. allocated(self%sliding)) return
      do i = 1, size(self%friction)
         associate (liner => self%liners(self%sliding(1, i)))
            call equations%link_motion(liner%first_link + beam_links*size(liner%joints) + self%sliding(2, i), motion)
            liner%ties(self%sliding(2, i))%move = liner%ties(self%sliding(2, i))%level*motion
         end associate
      end do
   end subroutine predict_sliding

   !> Lines on the ties that changed their state most often in an attempt.
   function tell_changes(self, context, most) result(text)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: most              !! lines
      character(len=:), allocatable :: text
      character(len=9), parameter :: names(0:4) = [character(len=9) :: 'open', 'held', 'sliding', 'parting', 'parting']
      logical, allocatable :: told(:)
      integer :: i, k, n
      text = ''
      do k = 1, n_liners(self)
         associate (ties => self%liners(k)%ties)
            if (allocated(told)) deallocate (told)
            allocate (told(size(ties)), source=.false.)
            do n = 1, min(most, size(ties))
               i = maxloc(ties%changes, 1, .not. told)
               told(i) = .true.
               if (ties(i)%changes == 0) exit
               associate (point => on_segment(context, ties(i)%b, ties(i)%arm) + context%state%datum)
                  text = text//new_line('a')//'  the back of '// &
                         block_name(context%blocks, context%parameters, ties(i)%b)// &
                         ' at ('//to_string(point(1))//', '//to_string(point(2))//'): '//counted(ties(i)%changes, 'change')// &
                         ', now '//trim(names(ties(i)%state))
               end associate
            end do
         end associate
      end do
   end function tell_changes

   !> Impulses on the blocks by ties that have closed in the step.
   subroutine add_impulses(self, equations, dt, impulse)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: dt                             !! step [time]
      real(wp), intent(inout), contiguous :: impulse(:, :)   !! (6, nb)
      type(tie_response_type) :: at_end
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link + beam_links*size(liner%joints)
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts .or. tie%level <= self%level) cycle
                  call respond(self, liner, tie, tie%motion + tie%move, at_end)
                  if (any(abs(at_end%force) > 0)) call equations%add_link_force(c + i, -dt*at_end%force, impulse)
               end associate
            end do
         end associate
      end do
   end subroutine add_impulses

   !> Dashpots of the ties with a joint in a dynamic step, as contacts have them (rockdda_interaction_dashpots):
   !> undamped, friction feeds the vibration of the normal forces on which it depends.
   subroutine set_dashpots(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp), allocatable :: stiffness(:, :), holds(:)
      real(wp) :: squared(2), ratio
      integer :: b, i, k, side
      if (.not. allocated(self%laws)) return
      allocate (stiffness(2, context%blocks%n_blocks), holds(context%blocks%n_blocks))
      stiffness = 0
      do k = 1, n_liners(self)
         do i = 1, size(self%liners(k)%ties)
            associate (tie => self%liners(k)%ties(i))
               tie%drag = 0
               if (.not. tie%acts) cycle
               stiffness(:, tie%a) = stiffness(:, tie%a) + self%liners(k)%stiffness*tie%length
               stiffness(:, tie%b) = stiffness(:, tie%b) + self%liners(k)%stiffness*tie%length
            end associate
         end do
      end do
      if (.not. context%scheme%is_dynamic .or. .not. self%level > 0) return
      call context%blocks%count_holds(holds, context%released, context%held)
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (liner%joint == 0) cycle
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  ratio = self%laws(liner%joint)%damping_ratio
                  if (tie%sliding .and. .not. ratio > 0) ratio = context%parameters%sliding_damping
                  if (.not. ratio > 0) cycle
                  squared = 0
                  do side = 1, 2
                     b = merge(tie%a, tie%b, side == 1)
                     if (holds(b) > 1) cycle
                     squared = squared + stiffness(:, b)/context%state%mass(b)
                  end do
                  tie%drag = [(dashpot_coefficient(ratio, liner%stiffness(side)*tie%length, squared(side)), &
                               side=1, 2)]/(tie%level*context%dt)
               end associate
            end do
         end associate
      end do
   end subroutine set_dashpots

   !> Vectors of all links.
   subroutine place(self, context, equations)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: v(6, 2, 2), line(6, 2, 2)
      integer :: c, i, k, j
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
                  call joint_vectors(context%moving(a), context%moving(b), on_segment(context, a, joint%arm(:, 1)), &
                                     on_segment(context, b, joint%arm(:, 2)), joint%beam%angle + 0.5_wp* &
                                     (context%state%rotation(a) + context%state%rotation(b)), [0.5_wp, 0.5_wp], &
                                     [.true., .true.], v)
               end associate
               do j = 1, 2
                  line = 0
                  line(:, 1, :) = v(:, j, :)
                  call equations%set_vectors(c + j, line(:, :, 1), line(:, :, 2))
               end do
               line = 0
               line(:, 1, :) = v(:, 1, :)
               call equations%set_vectors(c + 4, line(:, :, 1), line(:, :, 2))
               line = 0
               line(3, 1, 1) = -1
               line(3, 1, 2) = 1
               call equations%set_vectors(c + 3, line(:, :, 1), line(:, :, 2))
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call joint_vectors(context%moving(tie%a), context%moving(tie%b), first_point(context, tie), &
                                     on_segment(context, tie%b, tie%arm), tie%angle + context%state%rotation(tie%b), &
                                     [0.0_wp, 1.0_wp], [.not. tie%on_rock, .true.], v)
                  v(4, 1, 2) = tie%shape(1)
                  v(5, 2, 2) = tie%shape(2)
                  v(6, 1, 2) = tie%shape(3)
                  call equations%set_vectors(c, v(:, :, 1), v(:, :, 2))
               end associate
            end do
         end associate
      end do
   end subroutine place

   !> Derivatives of the components of the way between two points, of which axes turn with shares of the rotations of
   !> their blocks.
   pure subroutine joint_vectors(a, b, x, y, angle, share, rigid, v)
      type(moving_block_type), intent(in) :: a, b
      real(wp), intent(in) :: x(2), y(2)         !! points on both blocks at the start of the step [length]
      real(wp), intent(in) :: angle              !! of the first axis there
      real(wp), intent(in) :: share(2)
      logical, intent(in) :: rigid(2)            !! strains of the block do not move its point: it is a segment
      real(wp), intent(out) :: v(6, 2, 2)        !! unknowns, axes, blocks
      real(wp) :: turn, middle, chord, n(2), mean(2), d(6, 2)
      integer :: j
      turn = share(1)*a%angle + share(2)*b%angle
      middle = angle + 0.5_wp*turn
      chord = 1
      if (abs(turn) > 0) chord = 2*sin(0.5_wp*turn)/turn
      d = reshape([a%d, b%d], [6, 2])
      where (spread(rigid, 1, 3)) d(4:6, :) = 0
      mean = (y - x) + 0.5_wp*(mean_displacement(d(:, 2), y, b) - mean_displacement(d(:, 1), x, a))
      n = [cos(middle), sin(middle)]
      do j = 1, 2
         v(:, j, 1) = -mean_load(cos(0.5_wp*turn)*n, x, a)
         v(:, j, 2) = mean_load(cos(0.5_wp*turn)*n, y, b)
         where (spread(rigid, 1, 3)) v(4:6, j, :) = 0
         v(3, j, :) = v(3, j, :) + share*chord*(-n(2)*mean(1) + n(1)*mean(2))
         n = [-n(2), n(1)]
      end do
   end subroutine joint_vectors

   !> Stiffness and load of the links, linear at the motion of the last round.
   subroutine add_to_links(self, equations)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      real(wp) :: f(3), stiffness(2, beam_links), force(2, beam_links), coupling(beam_links)
      integer, parameter :: rows(beam_links) = [1, 2, 3, 4]
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
                  f = t%f - matmul(t%stiffness, joint%at)
                  stiffness = 0
                  force = 0
                  stiffness(1, :) = self%level*[t%stiffness(1, 1), t%stiffness(2, 2), t%stiffness(3, 3), 0.0_wp]
                  coupling = self%level*[t%stiffness(1, 2), t%stiffness(2, 3), t%stiffness(3, 1), 0.0_wp]
                  force(1, 1:3) = -f
               end associate
               call equations%set_links(beam_links, rows, c, stiffness, force, coupling)
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  stiffness = 0
                  force = 0
                  if (tie%acts) then
                     stiffness(:, 1) = tie%tangent
                     force(:, 1) = stiffness(:, 1)*tie%at - tie%force
                  end if
                  call equations%set_links(1, [1], c - 1, tie%factor*tie%level*stiffness(:, 1:1), &
                                           tie%factor*force(:, 1:1), [0.0_wp])
               end associate
            end do
         end associate
      end do
   end subroutine add_to_links

   !> Changes of deformation.
   subroutine predict(self, equations)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      real(wp) :: motion(2)
      integer :: c, i, j, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               do j = 1, 3
                  call equations%link_motion(c + j, motion)
                  liner%joints(i)%move(j) = self%level*motion(1)
               end do
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               liner%ties(i)%move = 0
               if (.not. liner%ties(i)%acts) cycle
               call equations%link_motion(c, motion)
               liner%ties(i)%move = liner%ties(i)%level*motion
            end do
         end associate
      end do
   end subroutine predict

   !> Keep the present motion.
   subroutine keep(self)
      class(liners_type), intent(inout) :: self
      integer :: i, k
      do k = 1, n_liners(self)
         do i = 1, size(self%liners(k)%joints)
            self%liners(k)%joints(i)%kept = self%liners(k)%joints(i)%move
         end do
         do i = 1, size(self%liners(k)%ties)
            self%liners(k)%ties(i)%kept = self%liners(k)%ties(i)%move
         end do
      end do
   end subroutine keep

   !> A motion at a fraction of the way.
   subroutine shorten(self, fraction)
      class(liners_type), intent(inout) :: self
      real(wp), intent(in) :: fraction
      integer :: i, k
      do k = 1, n_liners(self)
         do i = 1, size(self%liners(k)%joints)
            associate (joint => self%liners(k)%joints(i))
               joint%move = joint%kept + fraction*(joint%move - joint%kept)
            end associate
         end do
         do i = 1, size(self%liners(k)%ties)
            associate (tie => self%liners(k)%ties(i))
               tie%move = tie%kept + fraction*(tie%move - tie%kept)
            end associate
         end do
      end do
   end subroutine shorten

   !> Forces by the laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(liners_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i))
                  call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%kept + &
                                    fraction*(joint%move - joint%kept), response)
               end associate
               force(:, c + 1:c + beam_links) = 0
               force(1, c + 1:c + 3) = response%f
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               force(:, c) = 0
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call respond(self, liner, tie, tie%motion + tie%kept + fraction*(tie%move - tie%kept), of_tie)
               end associate
               force(:, c) = liner%ties(i)%factor*of_tie%force
            end do
         end associate
      end do
   end subroutine lawful_forces

   !> Deformations that the expected motion gives otherwise than the solution, as shares of the largest force of the
   !> lining.
   subroutine measure_placement(self, context, equations)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: way(2), d(3), scale, largest
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            ! a link without force among others has lengths that are off by rounding alone
            largest = maxval([0.0_wp, (norm2(liner%joints(i)%tangent%f(1:2)), i=1, size(liner%joints)), &
                              (norm2(liner%ties(i)%force), i=1, size(liner%ties))])
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
                  d = moved_beam(context, joint, equations%x)
                  scale = max(largest, min(equations%block_force(a), equations%block_force(b)))
                  d = matmul(joint%tangent%stiffness, d - joint%d - joint%move/self%level)
                  if (scale > 0) equations%link_off(c + 1) = norm2(d(1:2))/scale
               end associate
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  way = moved_tie(context, tie, equations%x) - tie%motion - tie%move/tie%level
                  scale = max(largest, min(equations%block_force(tie%a), equations%block_force(tie%b)))
                  if (scale > 0) equations%link_off(c) = norm2(tie%tangent*way)/scale
               end associate
            end do
         end associate
      end do
   end subroutine measure_placement

   !> Linear at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge(self, n_changes, n_unsettled)
      class(liners_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: missing(3), scale(3), used(2), largest
      integer :: i, k
      n_changes = 0
      n_unsettled = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
                  call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%move, response)
                  missing = response%f - (t%f + matmul(t%stiffness, joint%move - joint%at))
                  scale = sqrt(joint%beam%flexibility)
                  if (maxval(abs(missing)*scale) > agreement*maxval(abs(response%f)*scale) + rounding*maxval( &
                      (abs(joint%d) + abs(joint%move))*liner%section%modulus/scale) .or. &
                      .not. allclose(response%stiffness, t%stiffness, scale)) n_changes = n_changes + 1
                  joint%at = joint%move
                  joint%tangent = response
               end associate
            end do
            largest = largest_pressure(liner)
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call respond(self, liner, tie, tie%motion + tie%move, of_tie)
                  used = tie%force + tie%tangent*(tie%move - tie%at)
                  ! one that slides back holds first
                  if (slides(tie%state) .and. slides(of_tie%state) .and. of_tie%force(2)*tie%force(2) < 0) then
                     of_tie%state = merge(tie_state%held, tie_state%at_tension, of_tie%state == tie_state%slides)
                     of_tie%force(2) = of_tie%trial
                     of_tie%stiffness(2) = liner%stiffness(2)*tie%length + tie%drag(2)
                  end if
                  if (of_tie%state /= tie%state) then
                     n_changes = n_changes + 1
                     tie%changes = tie%changes + 1
                  else if (norm2(of_tie%force - used) > friction_agreement*max(norm2(used), tie%length*largest) .and. &
                           of_tie%state /= tie_state%held) then
                     n_unsettled = n_unsettled + 1
                  end if
                  tie%state = of_tie%state
                  tie%force = of_tie%force
                  tie%tangent = of_tie%stiffness
                  tie%at = tie%move
               end associate
            end do
         end associate
      end do
      n_unsettled = n_unsettled + n_changes

   contains

      !> Is the shear force of a tie at its limit?
      pure logical function slides(state)
         integer, intent(in) :: state
         slides = state == tie_state%slides .or. state == tie_state%parts
      end function slides

      !> Are two stiffnesses equal, in the scale of the flexibilities?
      pure logical function allclose(a, b, scale)
         real(wp), intent(in) :: a(3, 3), b(3, 3), scale(3)
         integer :: j
         allclose = .true.
         do j = 1, 3
            if (any(abs(a(:, j) - b(:, j))*scale*scale(j) > agreement* &
                    max(abs(a(j, j))*scale(j)**2, abs(b(j, j))*scale(j)**2))) allclose = .false.
         end do
      end function allclose

   end subroutine judge

   !> What a lining does in a step.
   pure subroutine finish(self, k, new, work, slipped, stored, freed)
      class(liners_type), intent(in) :: self
      integer, intent(in) :: k
      type(liner_type), intent(out) :: new       !! with the state of the end of the step
      real(wp), intent(out) :: work              !! of the forces that have acted
      real(wp), intent(out) :: slipped           !! work of slip
      real(wp), intent(out) :: stored(2)         !! energy at the start and the end
      real(wp), intent(out) :: freed             !! before the latter, by what has cracked or broken
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie, last
      real(wp) :: motion(2), d(3), change
      integer :: i
      new = self%liners(k)
      work = 0
      slipped = 0
      stored = 0
      freed = 0
      if (.not. new%is_there) return
      do i = 1, size(new%joints)
         associate (joint => new%joints(i))
            call respond_beam(joint%beam, new%section, joint%state, joint%d, response)
            stored(1) = stored(1) + response%energy
            call respond_beam(joint%beam, new%section, joint%state, joint%d + joint%move, response)
            work = work + dot_product(response%f, joint%move)/self%level
            d = joint%d + joint%move/self%level
            if (self%level < 1) call respond_beam(joint%beam, new%section, joint%state, d, response)
            change = response%energy
            call accept_beam(new%section, response, joint%state)
            call respond_beam(joint%beam, new%section, joint%state, d, response)
            freed = freed + (change - response%energy)
            stored(2) = stored(2) + response%energy
         end associate
      end do
      do i = 1, size(new%ties)
         associate (tie => new%ties(i))
            if (.not. tie%acts) cycle
            call respond(self, new, tie, tie%motion, of_tie)
            stored(1) = stored(1) + of_tie%energy
            call respond(self, new, tie, tie%motion + tie%move, of_tie)
            work = work + dot_product(of_tie%force, tie%move)/tie%level
            motion = tie%motion + tie%move/tie%level
            tie%drag = 0
            call respond(self, new, tie, motion, last)
            tie%sliding = last%state == tie_state%slides
            change = 0
            if (last%state == tie_state%slides .or. last%state == tie_state%parts) then
               change = (motion(2) - last%force(2)/(new%stiffness(2)*tie%length)) - tie%free(2)
            else if (last%state == tie_state%open) then
               change = motion(2) - tie%free(2)
            end if
            tie%free(2) = tie%free(2) + change
            tie%slip = tie%slip + abs(change)
            slipped = slipped + last%force(2)*change
            if (last%breaks) tie%bonded = .false.
            change = last%energy
            call respond(self, new, tie, motion, last)
            freed = freed + (change - last%energy)
            stored(2) = stored(2) + last%energy
         end associate
      end do
   end subroutine finish

   !> Stored energy, and the work of slip and of breaking.
   subroutine add_energies(self, context, d, balance)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      type(liner_type) :: new
      real(wp) :: work, slipped, stored(2), freed, start
      integer :: k
      associate (unused => context%dt, not_used => d)
      end associate
      if (n_liners(self) == 0) return
      start = 0
      do k = 1, n_liners(self)
         call finish(self, k, new, work, slipped, stored, freed)
         call balance%add(energy%friction, slipped)
         call balance%add(energy%dissipated, work - (stored(2) - stored(1)) - slipped - freed)
         call balance%add(energy%discarded, freed)
         start = start + stored(1)
         balance%other_energy = balance%other_energy + stored(2)
      end do
      call balance%add(energy%geometry, start - self%stored)
   end subroutine add_energies

   !> States at the end of the step, and places in the rock.
   subroutine commit(self, context, d)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      type(liner_type) :: new
      real(wp) :: work, slipped, stored(2), freed
      integer :: i, k
      self%stored = 0
      do k = 1, n_liners(self)
         if (.not. self%liners(k)%is_there) cycle
         call finish(self, k, new, work, slipped, stored, freed)
         do i = 1, size(new%joints)
            new%joints(i)%d = moved_beam(context, self%liners(k)%joints(i), d)
         end do
         do i = 1, size(new%ties)
            associate (tie => new%ties(i))
               if (.not. tie%acts) cycle
               tie%motion = moved_tie(context, self%liners(k)%ties(i), d)
               tie%bent = tie%bent + by_shape(tie, d(4:6, tie%b))
            end associate
         end do
         self%liners(k) = new
         self%stored = self%stored + stored(2)
         do i = 1, size(self%liners(k)%ties)
            associate (tie => self%liners(k)%ties(i))
               if (tie%a > 0 .and. tie%on_rock) call move_point(d(:, tie%a), context%state%centroid(:, tie%a), &
                                                                context%parameters%exact_rotation, tie%at_a)
            end associate
         end do
      end do
   end subroutine commit

   !> Forces on the blocks at their new places.
   subroutine add_forces(self, context, forces)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: x(2), y(2)
      integer :: i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
                  call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
                  x = on_segment(context, a, joint%arm(:, 1))
                  y = on_segment(context, b, joint%arm(:, 2))
                  call add(a, b, x, y, turned(response%f(1:2), joint%beam%angle + 0.5_wp* &
                           (context%state%rotation(a) + context%state%rotation(b))), [0.5_wp, 0.5_wp])
                  call forces%add_load(a, [0.0_wp, 0.0_wp, response%f(3)])
                  call forces%add_load(b, [0.0_wp, 0.0_wp, -response%f(3)])
               end associate
            end do
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. acts(context, tie)) cycle
                  call respond(self, liner, tie, tie%motion, of_tie)
                  call add(tie%a, tie%b, first_point(context, tie), on_segment(context, tie%b, tie%arm), &
                           turned(of_tie%force, tie%angle + context%state%rotation(tie%b)), [0.0_wp, 1.0_wp])
               end associate
            end do
         end associate
      end do

   contains

      !> A force that pulls two points together, and the moment that the way between them gives it.
      subroutine add(a, b, x, y, force, share)
         integer, intent(in) :: a, b
         real(wp), intent(in) :: x(2), y(2), force(2), share(2)
         real(wp) :: moment
         call forces%add_force(a, force, x - context%state%centroid(:, a))
         call forces%add_force(b, -force, y - context%state%centroid(:, b))
         moment = (y(1) - x(1))*force(2) - (y(2) - x(2))*force(1)
         call forces%add_load(a, [0.0_wp, 0.0_wp, share(1)*moment])
         call forces%add_load(b, [0.0_wp, 0.0_wp, share(2)*moment])
      end subroutine add

   end subroutine add_forces

   !> Save or load what lasts.
   subroutine exchange_state(self, archive)
      class(liners_type), intent(inout) :: self
      class(state_archive_type), intent(inout) :: archive
      real(wp), allocatable :: numbers(:)
      integer :: at, i, k, n
      logical :: fits
      call archive%section('liners')
      if (archive%saving) call pack_all(self, numbers)
      call archive%item('numbers', numbers)
      if (archive%saving .or. .not. allocated(numbers)) return
      at = 0
      fits = size(numbers) > 0
      if (fits) self%stored = numbers(1)
      at = 1
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (fits) fits = at + 4 <= size(numbers)
            if (.not. fits) exit
            liner%is_there = numbers(at + 1) > 0.5_wp
            liner%side = merge(1, -1, numbers(at + 2) > 0)
            call set_modulus(numbers(at + 3), liner)
            n = 0
            if (numbers(at + 4) >= 0 .and. numbers(at + 4) < 1.0e7_wp) n = nint(numbers(at + 4))
            at = at + 4
            if (allocated(liner%ties)) deallocate (liner%ties)
            allocate (liner%ties(n))
            if (.not. allocated(liner%path)) cycle
            fits = at + size(liner%path) + n*tie_numbers <= size(numbers)
            if (.not. fits) exit
            liner%path = reshape(numbers(at + 1:at + size(liner%path)), shape(liner%path))
            at = at + size(liner%path)
            do i = 1, n
               liner%ties(i) = unpack_tie(numbers(at + 1:at + tie_numbers))
               at = at + tie_numbers
            end do
            if (.not. liner%is_there) cycle
            call join_segments(liner)
            fits = at + beam_numbers*size(liner%joints) <= size(numbers)
            if (.not. fits) exit
            do i = 1, size(liner%joints)
               associate (state => liner%joints(i)%state)
                  state%free = numbers(at + 1:at + 3)
                  liner%joints(i)%d = numbers(at + 4:at + 6)
                  state%cracked = numbers(at + 7:at + 6 + n_sections) > 0.5_wp
                  state%crushed = numbers(at + 7 + n_sections:at + beam_numbers) > 0.5_wp
               end associate
               at = at + beam_numbers
            end do
         end associate
      end do
      ! what does not fit is no state: check_state refuses it
      if (.not. fits .or. at /= size(numbers)) self%stored = -huge(1.0_wp)
   end subroutine exchange_state

   !> What lasts of all linings.
   pure subroutine pack_all(self, numbers)
      class(liners_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: numbers(:)
      integer :: i, k
      numbers = [self%stored]
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            numbers = [numbers, as_number(liner%is_there), real(liner%side, wp), liner%section%modulus, &
                       real(size(liner%ties), wp)]
            if (.not. allocated(liner%path)) cycle
            numbers = [numbers, reshape(liner%path, [size(liner%path)])]
            numbers = [numbers, [(pack_tie(liner%ties(i)), i=1, size(liner%ties))]]
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               associate (state => liner%joints(i)%state)
                  numbers = [numbers, state%free, liner%joints(i)%d, as_number(state%cracked), &
                             as_number(state%crushed)]
               end associate
            end do
         end associate
      end do
   end subroutine pack_all

   !> 1 for true.
   elemental real(wp) function as_number(flag)
      logical, intent(in) :: flag
      as_number = merge(1.0_wp, 0.0_wp, flag)
   end function as_number

   !> Check what was loaded.
   subroutine check_state(self, context, check)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(value_check_type), intent(inout) :: check
      integer :: i, k
      check%group = 'liners'
      call check%holds(self%stored > -0.5_wp*huge(1.0_wp), 'numbers')
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. allocated(liner%path)) cycle
            call check%holds(all(abs(liner%path) <= largest_coordinate) .and. liner%section%modulus > 0 .and. &
                             liner%section%modulus < huge(1.0_wp), 'numbers')
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  call check%holds(tie%a >= 0 .and. tie%a <= context%blocks%n_blocks .and. tie%b > liner%before .and. &
                                   tie%b <= liner%before + liner%layout%n .and. tie%length > 0 .and. &
                                   tie%length <= largest_coordinate .and. all(abs(tie%at_a) <= largest_coordinate) &
                                   .and. all(abs(tie%arm) <= largest_coordinate) .and. abs(tie%angle) <= 1.0e9_wp &
                                   .and. all(abs(tie%free) <= largest_coordinate) .and. tie%slip >= 0 .and. &
                                   tie%slip <= largest_coordinate, 'numbers')
               end associate
            end do
            do i = 1, size(liner%joints)
               call check%is_finite([liner%joints(i)%state%free, liner%joints(i)%d], 'numbers')
            end do
         end associate
      end do
   end subroutine check_state

end module rockdda_interaction_liners
