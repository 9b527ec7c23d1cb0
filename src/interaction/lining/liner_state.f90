! SPDX-License-Identifier: MIT
!> What a lining has done at the end of a step, its forces on the blocks, and what lasts of it in a checkpoint.
module rockdda_interaction_liner_state
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_liner, only : liner_type, set_modulus, on_segment, turned, moved_beam, moved_tie, &
      first_point, by_shape, acts, respond
   use rockdda_interaction_liner_beam, only : beam_response_type, respond_beam, accept_beam, n_sections
   use rockdda_interaction_liner_placing, only : join_segments
   use rockdda_interaction_liner_ties, only : tie_type, tie_after_type, tie_response_type, tie_state
   implicit none
   private
   public :: finish_liner, commit_liner, add_forces_of, exchange_liners

contains

   !> What a lining does in a step: its outcome is set, and the states that its beams and ties then have.
   pure subroutine finish_liner(laws, level, liner)
      type(contact_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(liner_type), intent(inout) :: liner
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie, last
      type(tie_type) :: after
      real(wp) :: motion(2), d(3), change
      integer :: i
      liner%work = 0
      liner%slipped = 0
      liner%stored = 0
      liner%freed = 0
      if (.not. liner%is_there) return
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
            liner%stored(1) = liner%stored(1) + response%energy
            call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%move, response)
            liner%work = liner%work + dot_product(response%f, joint%move)/level
            d = joint%d + joint%move/level
            if (level < 1) call respond_beam(joint%beam, liner%section, joint%state, d, response)
            change = response%energy
            joint%state_after = joint%state
            call accept_beam(liner%section, response, joint%state_after)
            call respond_beam(joint%beam, liner%section, joint%state_after, d, response)
            liner%freed = liner%freed + (change - response%energy)
            liner%stored(2) = liner%stored(2) + response%energy
         end associate
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            call respond(laws, liner, tie, tie%motion, of_tie)
            liner%stored(1) = liner%stored(1) + of_tie%energy
            call respond(laws, liner, tie, tie%motion + tie%move, of_tie)
            liner%work = liner%work + dot_product(of_tie%force, tie%move)/tie%level
            after = tie
            after%drag = 0
            motion = tie%motion + tie%move/tie%level
            call respond(laws, liner, after, motion, last)
            after%sliding = last%state == tie_state%slides
            after%parted = .not. any(last%state == [tie_state%held, tie_state%slides])
            change = 0
            if (last%state == tie_state%slides .or. last%state == tie_state%parts) then
               change = (motion(2) - last%force(2)/(liner%stiffness(2)*tie%length)) - tie%free(2)
            else if (last%state == tie_state%open) then
               change = motion(2) - tie%free(2)
            end if
            after%free(2) = tie%free(2) + change
            after%slip = tie%slip + abs(change)
            liner%slipped = liner%slipped + last%force(2)*change
            if (last%breaks) after%bonded = .false.
            change = last%energy
            call respond(laws, liner, after, motion, last)
            liner%freed = liner%freed + (change - last%energy)
            liner%stored(2) = liner%stored(2) + last%energy
            tie%after = tie_after_type(after%free, after%slip, after%bonded, after%parted, after%sliding)
         end associate
      end do
   end subroutine finish_liner

   !> The states of the end of the step, and places in the rock.
   subroutine commit_liner(context, d, liner)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)    !! (6, nb)
      type(liner_type), intent(inout) :: liner
      integer :: i
      do i = 1, size(liner%joints)
         liner%joints(i)%d = moved_beam(context, liner%joints(i), d)
         liner%joints(i)%state = liner%joints(i)%state_after
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            tie%drag = 0
            if (tie%acts) then
               tie%motion = moved_tie(context, tie, d)
               tie%bent = tie%bent + by_shape(tie, d(4:6, tie%b))
               tie%free = tie%after%free
               tie%slip = tie%after%slip
               tie%bonded = tie%after%bonded
               tie%parted = tie%after%parted
               tie%sliding = tie%after%sliding
            end if
            if (tie%a > 0 .and. tie%on_rock) call move_point(d(:, tie%a), context%state%centroid(:, tie%a), &
                                                             context%parameters%exact_rotation, tie%at_a)
         end associate
      end do
   end subroutine commit_liner

   !> Forces of a lining on the blocks at their new places.
   subroutine add_forces_of(laws, context, liner, forces)
      type(contact_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      type(block_forces_type), intent(inout) :: forces
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: x(2), y(2)
      integer :: i
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
            call respond(laws, liner, tie, tie%motion, of_tie)
            call add(tie%a, tie%b, first_point(context, tie), on_segment(context, tie%b, tie%arm), &
                     turned(of_tie%force, tie%angle + context%state%rotation(tie%b)), [0.0_wp, 1.0_wp])
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

   end subroutine add_forces_of

   !> Save or load what lasts of all linings; `fits` is false when what was loaded belongs to others.
   subroutine exchange_liners(archive, liners, fits)
      class(state_archive_type), intent(inout) :: archive
      type(liner_type), intent(inout) :: liners(:)
      logical, intent(out) :: fits
      logical, allocatable :: there(:), on_rock(:), bonded(:), parted(:), sliding(:), cracked(:), crushed(:)
      integer, allocatable :: side(:), n_ties(:), behind(:), segment(:)
      real(wp), allocatable :: modulus(:), path(:, :), place(:, :), arm(:, :), angle(:), length(:), shape(:, :)
      real(wp), allocatable :: motion(:, :), bent(:, :), free(:, :), slip(:), deformation(:, :), free_beam(:, :)
      integer :: i, k, n(3)
      if (archive%saving) call collect()
      call archive%item('is_there', there)
      call archive%item('side', side)
      call archive%item('modulus', modulus)
      call archive%item('path', path)
      call archive%item('n_ties', n_ties)
      call archive%item('behind', behind)
      call archive%item('segment', segment)
      call archive%item('on_rock', on_rock)
      call archive%item('place', place)
      call archive%item('arm', arm)
      call archive%item('angle', angle)
      call archive%item('length', length)
      call archive%item('shape', shape)
      call archive%item('motion', motion)
      call archive%item('bent', bent)
      call archive%item('free', free)
      call archive%item('slip', slip)
      call archive%item('bonded', bonded)
      call archive%item('parted', parted)
      call archive%item('sliding', sliding)
      call archive%item('deformation', deformation)
      call archive%item('free_deformation', free_beam)
      call archive%item('cracked', cracked)
      call archive%item('crushed', crushed)
      fits = .true.
      if (archive%saving) return
      fits = allocated(there) .and. allocated(side) .and. allocated(modulus) .and. allocated(path) .and. &
         allocated(n_ties) .and. allocated(behind) .and. allocated(segment) .and. allocated(on_rock) .and. &
         allocated(place) .and. allocated(arm) .and. allocated(angle) .and. allocated(length) .and. allocated(shape) &
         .and. allocated(motion) .and. allocated(bent) .and. allocated(free) .and. allocated(slip) .and. &
         allocated(bonded) .and. allocated(parted) .and. allocated(sliding) .and. allocated(deformation) .and. &
         allocated(free_beam) .and. allocated(cracked) .and. allocated(crushed)
      if (.not. fits) return
      fits = all([size(there), size(side), size(modulus), size(n_ties)] == size(liners))
      if (.not. fits) return
      fits = all(n_ties >= 0 .and. n_ties <= size(behind)) .and. all(modulus > 0)
      if (.not. fits) return
      n = [sum([(size(liners(k)%path, 2), k=1, size(liners))]), 0, sum(n_ties)]
      fits = n(1) == size(path, 2) .and. size(path, 1) == 2 .and. all([size(behind), size(segment), size(on_rock), &
         size(place, 2), size(arm, 2), size(angle), size(length), size(shape, 2), size(motion, 2), size(bent, 2), &
         size(free, 2), size(slip), size(bonded), size(parted), size(sliding)] == n(3)) .and. &
         all([size(place, 1), size(arm, 1), &
         size(motion, 1), size(bent, 1), size(free, 1)] == 2) .and. size(shape, 1) == 3
      if (.not. fits) return
      n = 0
      do k = 1, size(liners)
         associate (liner => liners(k))
            liner%is_there = there(k)
            liner%side = merge(1, -1, side(k) > 0)
            call set_modulus(modulus(k), liner)
            liner%path = path(:, n(1) + 1:n(1) + size(liner%path, 2))
            n(1) = n(1) + size(liner%path, 2)
            if (allocated(liner%ties)) deallocate (liner%ties)
            allocate (liner%ties(n_ties(k)))
            do i = 1, n_ties(k)
               associate (tie => liner%ties(i), j => n(3) + i)
                  tie%a = behind(j)
                  tie%b = segment(j)
                  tie%on_rock = on_rock(j)
                  tie%at_a = place(:, j)
                  tie%arm = arm(:, j)
                  tie%angle = angle(j)
                  tie%length = length(j)
                  tie%shape = shape(:, j)
                  tie%motion = motion(:, j)
                  tie%bent = bent(:, j)
                  tie%free = free(:, j)
                  tie%slip = slip(j)
                  tie%bonded = bonded(j)
                  tie%parted = parted(j)
                  tie%sliding = sliding(j)
               end associate
            end do
            n(3) = n(3) + n_ties(k)
            if (.not. liner%is_there) cycle
            call join_segments(liner)
            fits = n(2) + size(liner%joints) <= size(deformation, 2) .and. &
                   n_sections*(n(2) + size(liner%joints)) <= min(size(cracked), size(crushed)) .and. &
                   size(deformation, 1) == 3 .and. size(free_beam, 1) == 3 .and. &
                   size(free_beam, 2) == size(deformation, 2)
            if (.not. fits) return
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), j => n(2) + i)
                  joint%d = deformation(:, j)
                  joint%state%free = free_beam(:, j)
                  joint%state%cracked = cracked(n_sections*(j - 1) + 1:n_sections*j)
                  joint%state%crushed = crushed(n_sections*(j - 1) + 1:n_sections*j)
               end associate
            end do
            n(2) = n(2) + size(liner%joints)
         end associate
      end do
      fits = n(2) == size(deformation, 2)

   contains

      !> What lasts, from all linings.
      subroutine collect()
         integer :: i, j, k, n(3)
         n = 0
         do k = 1, size(liners)
            n = n + [size(liners(k)%path, 2), merge(size(liners(k)%joints), 0, liners(k)%is_there), &
                     size(liners(k)%ties)]
         end do
         allocate (path(2, n(1)), behind(n(3)), segment(n(3)), on_rock(n(3)), place(2, n(3)), arm(2, n(3)), &
                   angle(n(3)), length(n(3)), shape(3, n(3)), motion(2, n(3)), bent(2, n(3)), free(2, n(3)), &
                   slip(n(3)), bonded(n(3)), parted(n(3)), sliding(n(3)), deformation(3, n(2)), free_beam(3, n(2)), &
                   cracked(n_sections*n(2)), crushed(n_sections*n(2)))
         there = liners%is_there
         side = liners%side
         modulus = liners%section%modulus
         n_ties = [(size(liners(k)%ties), k=1, size(liners))]
         n = 0
         do k = 1, size(liners)
            associate (liner => liners(k))
               path(:, n(1) + 1:n(1) + size(liner%path, 2)) = liner%path
               n(1) = n(1) + size(liner%path, 2)
               do i = 1, size(liner%ties)
                  j = n(3) + i
                  associate (tie => liner%ties(i))
                     behind(j) = tie%a
                     segment(j) = tie%b
                     on_rock(j) = tie%on_rock
                     place(:, j) = tie%at_a
                     arm(:, j) = tie%arm
                     angle(j) = tie%angle
                     length(j) = tie%length
                     shape(:, j) = tie%shape
                     motion(:, j) = tie%motion
                     bent(:, j) = tie%bent
                     free(:, j) = tie%free
                     slip(j) = tie%slip
                     bonded(j) = tie%bonded
                     parted(j) = tie%parted
                     sliding(j) = tie%sliding
                  end associate
               end do
               n(3) = n(3) + size(liner%ties)
               if (.not. liner%is_there) cycle
               do i = 1, size(liner%joints)
                  j = n(2) + i
                  deformation(:, j) = liner%joints(i)%d
                  free_beam(:, j) = liner%joints(i)%state%free
                  cracked(n_sections*(j - 1) + 1:n_sections*j) = liner%joints(i)%state%cracked
                  crushed(n_sections*(j - 1) + 1:n_sections*j) = liner%joints(i)%state%crushed
               end do
               n(2) = n(2) + size(liner%joints)
            end associate
         end do
      end subroutine collect

   end subroutine exchange_liners

end module rockdda_interaction_liner_state
