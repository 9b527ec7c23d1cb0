! SPDX-License-Identifier: MIT
!> A lining: its segments, beams and ties, and how they move (docs/theory.md, "Linings").
!>
!> A segment is a block behind those of the model (`n_segments` of rockdda_model_blocks) that the search for contacts
!> does not find. It moves as a rigid body; its strains, which carry next to nothing, represent curvature, strain and
!> slope of its back between its node and where the rock holds it: with them a rigid back does not stiffen rock that is
!> finer than the segments. Neighbours are joined by a beam
!> (rockdda_interaction_liner_beam), and the back of each is held to the rock, or to the lining below, at points
!> (rockdda_interaction_liner_ties). The axis of the beams, and the weight, lie in the line of the lining.
module rockdda_interaction_liner
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_liner_layout, only : liner_layout_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_finite_rotation, only : end_displacement, new_moved_block
   use rockdda_interaction_liner_beam, only : liner_section_type, beam_type, beam_state_type, beam_response_type, &
      respond_beam
   use rockdda_interaction_liner_places, only : faces_of_path, segment_outline
   use rockdda_interaction_liner_ties, only : tie_type, tie_response_type, respond_tie
   implicit none
   private
   public :: node_state, liner_joint_type, liner_type, beam_links, links_of, set_young, set_modulus, &
      installed_centroids, on_segment, turned, along, moved_beam, moved_tie, first_point, by_shape, acts, &
      respond, energy_of, largest_pressure

   !> Links of a beam: along both axes, of the rotation, and along the first axis again for what couples it with the
   !> rotation. A tie has one.
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
   type :: liner_joint_type
      type(beam_type) :: beam
      type(beam_state_type) :: state
      integer :: block(2) = 0          !! segments
      real(wp) :: arm(2, 2) = 0        !! from their centroids to the centre of the beam, as installed [length]
      real(wp) :: d(3) = 0             !! deformation now [length, rad]
      real(wp) :: move(3) = 0, kept(3) = 0   !! its change where forces act
      real(wp) :: at(3) = 0            !! change at which the last round is linear
      type(beam_response_type) :: tangent
      type(beam_state_type) :: state_after   !! of the end of the step
   end type liner_joint_type

   type :: liner_type
      character(len=:), allocatable :: name
      integer :: installs = 0, removes = 0       !! stages; 0: from the start, never
      type(liner_layout_type) :: layout          !! on its line at the start
      type(liner_section_type) :: section
      real(wp) :: poisson = 0.2_wp
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
      type(liner_joint_type), allocatable :: joints(:)
      type(tie_type), allocatable :: ties(:)
      integer :: first_link = 0
      ! of the step that ends
      real(wp) :: work = 0                       !! of the forces that have acted
      real(wp) :: slipped = 0                    !! work of slip
      real(wp) :: stored(2) = 0                  !! energy at the start and the end
      real(wp) :: freed = 0                      !! before the latter, by what has cracked or broken
   end type liner_type

contains

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

   !> Centroids that the segments had when they were installed.
   pure function installed_centroids(liner) result(center)
      type(liner_type), intent(in) :: liner
      real(wp) :: center(2, liner%layout%n), area, moments(3)
      real(wp) :: faces(2, size(liner%path, 2), 2)
      integer :: i
      faces = faces_of_path(liner%path, liner%layout%closed, liner%side, liner%section%thickness)
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

   !> Components of a vector along two axes.
   pure function along(angle, v)
      real(wp), intent(in) :: angle, v(2)
      real(wp) :: along(2)
      along = turned(v, -angle)
   end function along

   !> Deformation of a beam after a motion of its segments, from the present one: what changes is found from what moves,
   !> so that it has the digits of the motion.
   pure function moved_beam(context, joint, d) result(deformation)
      type(step_context_type), intent(in) :: context
      type(liner_joint_type), intent(in) :: joint
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

   !> Forces of a tie.
   pure subroutine respond(laws, liner, tie, motion, response)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(liner_type), intent(in) :: liner
      type(tie_type), intent(in) :: tie
      real(wp), intent(in) :: motion(2)
      type(tie_response_type), intent(out) :: response
      if (liner%joint > 0 .and. allocated(laws)) then
         call respond_tie(tie, liner%stiffness, motion, response, laws(liner%joint))
      else
         call respond_tie(tie, liner%stiffness, motion, response)
      end if
   end subroutine respond

   !> Energy of a lining in the present state.
   pure real(wp) function energy_of(laws, context, liner) result(stored)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      integer :: i
      stored = 0
      if (.not. liner%is_there) return
      do i = 1, size(liner%joints)
         call respond_beam(liner%joints(i)%beam, liner%section, liner%joints(i)%state, liner%joints(i)%d, response)
         stored = stored + response%energy
      end do
      do i = 1, size(liner%ties)
         if (.not. acts(context, liner%ties(i))) cycle
         call respond(laws, liner, liner%ties(i), liner%ties(i)%motion, of_tie)
         stored = stored + of_tie%energy
      end do
   end function energy_of

   !> Largest normal force over length of the ties of a lining, in the last judgement.
   pure real(wp) function largest_pressure(liner) result(largest)
      type(liner_type), intent(in) :: liner
      integer :: i
      largest = 0
      do i = 1, size(liner%ties)
         if (liner%ties(i)%acts) largest = max(largest, abs(liner%ties(i)%force(1))/liner%ties(i)%length)
      end do
   end function largest_pressure

   !> Links of one lining.
   pure integer function links_of(liner) result(n)
      type(liner_type), intent(in) :: liner
      n = 0
      if (liner%is_there) n = beam_links*size(liner%joints) + size(liner%ties)
   end function links_of

end module rockdda_interaction_liner
