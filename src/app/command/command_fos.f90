! SPDX-License-Identifier: MIT
!> rockdda fos: search the factor at which a model loses its equilibrium; its progress, and the factor as text and JSON.
module rockdda_app_command_fos
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_kinks, only : report_tips
   use rockdda_model_options, only : is_set
   use rockdda_model_liner_layout, only : title_of_liner
   use rockdda_model_material_names, only : number_of_material
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_input, only : model_input_type, run_name
   use rockdda_run_model_input, only : read_model
   use rockdda_run_output_choice, only : choose_output
   use rockdda_run_search_results, only : write_failing_trial
   use rockdda_run_thread_choice, only : thread_choice_type
   use rockdda_run_mechanism, only : kind_of
   use rockdda_run_search_options, only : search_kind, search_names, search_options_type
   use rockdda_run_support_uses, only : support_use_type, name_of_support, n_bolts_of, state_word
   use rockdda_run_trial, only : search_observer_type, trial_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_command_run, only : find_run_files
   use rockdda_app_process, only : print_error, watch_signals, print_line
   use rockdda_app_report, only : put_messages, show_messages, report_failure
   use rockdda_app_json, only : json_type
   use rockdda_app_progress, only : progress_type
   use rockdda_app_stop_request, only : stop_request_type
   implicit none
   private
   public :: run_fos

   !> Largest number of blocks in a line.
   integer, parameter :: most_listed = 20

   !> Signals and progress of a search in a terminal.
   type, extends(search_observer_type) :: search_watch_type
      type(stop_request_type) :: request
      type(progress_type), pointer, private :: bar => null()
      logical, private :: quiet = .false.
   contains
      procedure :: begin
      procedure :: finish
      procedure :: is_requested
      procedure :: progress => show_progress
      procedure :: warn => show_warning
   end type search_watch_type

contains

   !> Run the command; returns the exit code.
   subroutine run_fos(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(command_line_type) :: request
      type(model_input_type) :: input
      type(diagnostics_type) :: messages, tips
      type(error_type), allocatable :: error
      type(factor_search_type), allocatable :: search
      type(search_watch_type) :: watch
      character(len=:), allocatable :: output
      logical :: ok, over
      type(thread_choice_type) :: threads
      allocate (search)
      output = ''
      watch%request%deadline = huge(1.0_wp)
      ! a model without stages need not say where its run ends
      request = line
      if (.not. is_set(request%steps)) request%steps = huge(1)
      call find_run_files(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call read_model(request, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
         call threads%start(input%blocks%n_blocks, input%options%threads)
         if (len(line%output) > 0) call choose_output(line, input, output, error)
         if (.not. allocated(error)) call search%prepare(input, line%search, stem_of_search(output, input), error)
      end if
      if (is_set(input%options%max_wall)) watch%request%deadline = wall_seconds() + input%options%max_wall
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      messages = messages%summarised()
      if (.not. line%quiet) then
         call show_messages(messages, severity%warning)
         ! the factor may rest on them
         if (input%parameters%by_length) call report_tips(input%blocks, tips)
         call show_messages(tips, severity%note)
      end if
      call watch_signals()
      call watch%begin(line%quiet)
      call search%run(input, watch, error)
      ! a search without a factor is over, too; one that failed may go on from its trials
      over = .not. search%interrupted
      call messages%append(search%warnings)
      if (over .and. .not. allocated(error) .and. len(output) > 0 .and. search%has_factor()) &
         call write_failing_trial(search, line, input, output, messages, watch, search%interrupted, error)
      call watch%finish()
      if (over .and. .not. search%interrupted .and. search%journal%is_kept) call search%journal%remove()
      if (search%interrupted .and. .not. allocated(error)) call make_error(error, error_code%stopped, 'stopped ('// &
         watch%request%reason()//'); the same command continues from the trials in '//search%journal%stem//'.txt')
      if (allocated(error)) then
         call report_failure(line, no_messages(), error, exit_code)
         return
      end if
      call print_factor(line, search, output, messages, ok)
      exit_code = 0
      if (search%options%has_factors() .and. .not. search%stands()) exit_code = error_code%computation
      if (.not. ok) exit_code = error_code%output
   end subroutine run_fos

   !> Messages that were shown already.
   pure type(diagnostics_type) function no_messages()
      no_messages%n = 0
   end function no_messages

   !> Stem of the files of a search: that of its results, or the name of the run.
   function stem_of_search(output, input) result(stem)
      character(len=*), intent(in) :: output            !! '': none
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable :: stem
      stem = run_name(input)
      if (len(output) == 0) return
      stem = checkpoint_path(output)
      stem = stem(1:index(stem, '.ckpt.h5', back=.true.) - 1)
   end function stem_of_search

   !> Begin to show progress.
   subroutine begin(self, quiet)
      class(search_watch_type), intent(inout) :: self
      logical, intent(in) :: quiet
      self%quiet = quiet
      allocate (self%bar)
      call self%bar%begin(quiet)
   end subroutine begin

   !> End it.
   subroutine finish(self)
      class(search_watch_type), intent(inout) :: self
      if (.not. associated(self%bar)) return
      call self%bar%finish()
      deallocate (self%bar)
   end subroutine finish

   !> Has a signal arrived, or is the time over?
   logical function is_requested(self)
      class(search_watch_type), intent(in) :: self
      is_requested = self%request%is_requested()
   end function is_requested

   !> Show what is tried. Trials in several threads call this.
   subroutine show_progress(self, text)
      class(search_watch_type), intent(in) :: self
      character(len=*), intent(in) :: text
      if (self%quiet) return
      !$omp critical (rockdda_show_progress)
      call self%bar%update(0.0_wp, text)
      !$omp end critical (rockdda_show_progress)
   end subroutine show_progress

   !> Print a warning.
   subroutine show_warning(self, text)
      class(search_watch_type), intent(in) :: self
      character(len=*), intent(in) :: text
      if (.not. self%quiet) call print_error('rockdda: warning: '//text)
   end subroutine show_warning

   !> Print the factor.
   subroutine print_factor(line, search, output, messages, ok)
      type(command_line_type), intent(in) :: line
      type(factor_search_type), intent(in) :: search
      character(len=*), intent(in) :: output            !! path of the results, '': none
      type(diagnostics_type), intent(in) :: messages
      logical, intent(out) :: ok
      character(len=*), parameter :: nl = new_line('a')
      type(trial_type) :: failing
      character(len=:), allocatable :: text
      failing = search%limit_trial(stable=.false.)
      if (line%json) then
         call print_json(search, failing, messages, ok)
         return
      end if
      text = joints_text(search)
      if (search%options%has_factors()) text = text//'factors: '//search%factors%to_text()//nl
      if (search%has_factor()) then
         text = text//mechanism_text(search, failing)//nl//supports_text(search, failing)
         if (len(output) > 0) text = text//'results of the failing trial: '//output//nl
         text = text//factor_text(search)
      end if
      if (search%options%has_factors()) then
         if (search%has_factor()) text = text//nl
         text = text//'stands with the factored values: '//trim(merge('yes', 'no ', search%stands()))//', reserve '
         if (search%has_factor()) then
            text = text//decimals(search, middle(search))
         else
            text = text//'above '//to_string(search%state%stable)
         end if
      end if
      call print_line(text, ok)
   end subroutine print_factor

   !> The joints whose strength was reduced, or the loads that were multiplied, and how much of cohesive joints is open
   !> at the limit; each behind it a line end.
   function joints_text(search) result(text)
      type(factor_search_type), intent(in) :: search
      character(len=:), allocatable :: text
      character(len=*), parameter :: nl = new_line('a')
      character(len=6) :: percent
      real(wp) :: length(size(search%searched%joints)), open(size(search%searched%joints))
      type(trial_type) :: stable
      integer :: i
      length = search%joint_length()
      stable = search%limit_trial(stable=.true.)
      open = stable%open
      text = ''
      if (search%options%kind == search_kind%load) then
         text = 'loads multiplied: '
         do i = 1, size(search%searched%load_names)
            if (i > 1) text = text//', '
            text = text//trim(search%searched%load_names(i))
         end do
         text = text//nl
      else if (search%options%kind == search_kind%strength) then
         do i = 1, size(length)
            if (.not. (search%searched%joints(i) .and. (length(i) > 0 .or. lies_behind_lining(search, i)))) cycle
            if (len(text) > 0) text = text//', '
            text = text//label(search, i)
            if (.not. length(i) > 0) text = text//' (behind linings)'
         end do
         text = 'strength reduced: '//text//nl
      end if
      associate (p => search%settled%parameters)
         do i = 1, size(length)
            if (.not. (length(i) > 0 .and. p%joint_materials(i)%cohesion > 0)) cycle
            write (percent, '(f6.1)') 100*open(i)
            text = text//'open at failure: '//trim(adjustl(percent))//' % of '//label(search, i)//' ('// &
                   p%shown(open(i)*length(i), 'length', 3)//' of '//p%shown(length(i), 'length', 3)//')'//nl
         end do
      end associate
   end function joints_text

   !> Is a joint material that of the back of a lining?
   pure logical function lies_behind_lining(search, i) result(lies)
      type(factor_search_type), intent(in) :: search
      integer, intent(in) :: i
      integer :: k
      lies = .false.
      associate (p => search%settled%parameters)
         if (.not. allocated(p%liners)) return
         do k = 1, size(p%liners)
            if (.not. allocated(p%liners(k)%joint_material)) cycle
            lies = lies .or. number_of_material(trim(adjustl(p%liners(k)%joint_material)), p%joint_materials) == i
         end do
      end associate
   end function lies_behind_lining

   !> Name of a joint material, or its number.
   pure function label(search, i)
      type(factor_search_type), intent(in) :: search
      integer, intent(in) :: i
      character(len=:), allocatable :: label
      label = to_string(i)
      associate (material => search%settled%parameters%joint_materials(i))
         if (.not. allocated(material%name)) return
         if (len_trim(material%name) > 0) label = trim(material%name)
      end associate
   end function label

   !> The blocks that move, and how; of linings how many segments.
   pure function mechanism_text(search, failing) result(text)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      character(len=:), allocatable :: text
      integer, allocatable :: segments(:)
      integer :: i, k
      text = 'mechanism: '//kind_of(failing%mechanism)//' of '
      associate (blocks => moving_blocks(search, failing))
         if (size(blocks) > 0) text = text//trim(merge('block ', 'blocks', size(blocks) == 1))
         do i = 1, min(size(blocks), most_listed)
            text = text//trim(merge(' ', ',', i == 1))//' '//to_string(blocks(i))
         end do
         if (size(blocks) > most_listed) text = text//', ... ('//to_string(size(blocks))//' blocks)'
         segments = moving_segments(search, failing)
         do k = 1, size(segments)
            if (segments(k) == 0) cycle
            if (.not. text(len(text) - 2:) == 'of ') text = text//' and '
            text = text//"lining '"//liner_name(search, k)//"' ("//counted(segments(k), 'segment')//')'
         end do
      end associate
   end function mechanism_text

   !> What each bolt and lining bears in the last stable and in the failing trial; each behind it a line end.
   function supports_text(search, failing) result(text)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      character(len=:), allocatable :: text
      character(len=*), parameter :: nl = new_line('a')
      type(trial_type) :: stable
      integer :: k, n
      text = ''
      stable = search%limit_trial(stable=.true.)
      n = size(failing%supports)
      if (n == 0 .or. size(stable%supports) /= n) return
      text = 'supports where it stands, and where it fails:'//nl
      do k = 1, min(n, most_listed)
         text = text//'  '//name_of_support(search%settled, k)//': '//shown(stable%supports(k))//'; '// &
                shown(failing%supports(k))//nl
      end do
      if (n > most_listed) text = text//'  ... ('//to_string(n)//'; --json has all)'//nl

   contains

      !> Force, share of the strength, state.
      function shown(one)
         type(support_use_type), intent(in) :: one
         character(len=:), allocatable :: shown
         logical :: is_lining
         is_lining = k > n_bolts_of(search%settled)
         shown = search%settled%parameters%shown(one%force, trim(merge('force/length', 'force       ', is_lining)), 3)
         if (one%use > 0 .and. one%use < 0.5_wp*huge(1.0_wp)) shown = shown//', '//to_string(100*one%use, 3)//' %'
         shown = shown//', '//state_word(one%state, is_lining)
         if (one%force < 0 .and. .not. is_lining) shown = shown//' in compression'
      end function shown

   end function supports_text

   !> The same as JSON.
   subroutine put_supports(search, failing, json)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      type(json_type), intent(inout) :: json
      type(trial_type) :: stable
      integer :: k
      stable = search%limit_trial(stable=.true.)
      call json%open('[', 'supports')
      do k = 1, size(failing%supports)
         call json%open('{', '')
         call json%put('name', name_of_support(search%settled, k))
         call json%put('kind', trim(merge('lining', 'bolt  ', k > n_bolts_of(search%settled))))
         if (k <= size(stable%supports)) call put('stable', stable%supports(k))
         call put('failing', failing%supports(k))
         call json%close('}')
      end do
      call json%close(']')

   contains

      !> Force, share of the strength, state.
      subroutine put(name, one)
         character(len=*), intent(in) :: name
         type(support_use_type), intent(in) :: one
         call json%open('{', name)
         call json%put('force', one%force)
         call json%put('use', one%use, one%use > 0)
         call json%put('state', state_word(one%state, k > n_bolts_of(search%settled)))
         call json%close('}')
      end subroutine put

   end subroutine put_supports

   !> Blocks of the model that move.
   pure function moving_blocks(search, failing) result(blocks)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      integer, allocatable :: blocks(:)
      associate (all => search%settled%blocks)
         blocks = pack(failing%mechanism%blocks, failing%mechanism%blocks <= all%n_blocks - all%n_segments)
      end associate
   end function moving_blocks

   !> Numbers of segments of each lining that move.
   pure function moving_segments(search, failing) result(segments)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      integer, allocatable :: segments(:)
      integer :: i, k, n
      n = 0
      associate (p => search%settled%parameters, all => search%settled%blocks)
         if (allocated(p%liners)) n = size(p%liners)
         allocate (segments(n), source=0)
         do i = 1, size(failing%mechanism%blocks)
            associate (b => failing%mechanism%blocks(i))
               if (b <= all%n_blocks - all%n_segments) cycle
               k = all%block_material(b) - p%first_liner_material
               segments(k) = segments(k) + 1
            end associate
         end do
      end associate
   end function moving_segments

   !> Name of a lining.
   pure function liner_name(search, k) result(name)
      type(factor_search_type), intent(in) :: search
      integer, intent(in) :: k
      character(len=:), allocatable :: name
      name = title_of_liner(search%settled%parameters%liners(k), k)
   end function liner_name

   !> The factor and its bracket.
   pure function factor_text(search) result(text)
      type(factor_search_type), intent(in) :: search
      character(len=:), allocatable :: text
      text = name_of(search%options)//': '//decimals(search, middle(search))//' (stable at '// &
             decimals(search, search%state%stable)//', fails at '//decimals(search, search%state%failing)//'; '// &
             to_string(size(search%tried))//' trials)'
   end function factor_text

   !> The searched quantity.
   pure function name_of(options) result(name)
      type(search_options_type), intent(in) :: options
      character(len=:), allocatable :: name
      select case (options%kind)
      case (search_kind%tilt); name = 'critical tilt'
      case (search_kind%push); name = 'critical push'
      case (search_kind%gravity); name = 'critical gravity'
      case (search_kind%load); name = 'load factor'
      case default; name = 'factor of safety'
      end select
      if (options%has_factors()) name = 'reserve'
   end function name_of

   !> A value with as many decimals as its tolerance deserves.
   pure function decimals(search, value) result(text)
      type(factor_search_type), intent(in) :: search
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=40) :: buffer, form
      integer :: n
      select case (search%options%kind)
      case (search_kind%tilt); n = 2
      case (search_kind%push); n = 4
      case (search_kind%load)
         ! the first digit by which both ends differ
         n = max(0, 1 + floor(-log10(max(abs(search%state%failing - search%state%stable), tiny(1.0_wp)))))
      case default; n = 3
      end select
      write (form, '(a,i0,a)') '(f0.', n, ')'
      write (buffer, form) value
      text = trim(adjustl(buffer))
      if (n == 0) text = text(:len(text) - 1)
      if (text(1:1) == '.') text = '0'//text
      if (index(text, '-.') == 1) text = '-0'//text(2:)
   end function decimals

   !> The middle between the stable and the failing value.
   pure real(wp) function middle(search)
      type(factor_search_type), intent(in) :: search
      real(wp) :: low
      low = min(search%state%stable, search%state%failing)
      middle = low + (max(search%state%stable, search%state%failing) - low)/2
   end function middle

   !> The search as JSON.
   subroutine print_json(search, failing, messages, ok)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      type(diagnostics_type), intent(in) :: messages
      logical, intent(out) :: ok
      type(json_type) :: json
      type(error_type), allocatable :: none
      real(wp) :: length(size(search%searched%joints)), open(size(search%searched%joints))
      type(trial_type) :: stable
      integer, allocatable :: blocks(:)
      character(len=:), allocatable :: kind
      integer :: i
      logical :: found
      length = search%joint_length()
      stable = search%limit_trial(stable=.true.)
      open = stable%open
      call json%open('{', '')
      found = search%has_factor()
      call json%put('factor', middle(search), found)
      call json%put('low', merge(min(search%state%stable, search%state%failing), search%state%stable, found))
      call json%put('high', max(search%state%stable, search%state%failing), found)
      call json%put('search', trim(search_names(search%options%kind)))
      call json%put('settled_strength', search%strength)
      if (search%options%has_factors()) then
         call json%put('stands', search%stands())
         call json%put('factors', search%factors%to_text())
      end if
      if (search%options%kind == search_kind%load) then
         call json%open('[', 'loads')
         do i = 1, size(search%searched%load_names)
            call json%put('', trim(search%searched%load_names(i)))
         end do
         call json%close(']')
      end if
      call json%open('[', 'joints')
      do i = 1, size(length)
         if (.not. length(i) > 0) cycle
         call json%open('{', '')
         call json%put('name', label(search, i))
         call json%put('reduced', search%options%kind == search_kind%strength .and. search%searched%joints(i))
         call json%put('length', length(i))
         call json%put('open', open(i))
         call json%close('}')
      end do
      call json%close(']')
      call json%open('[', 'trials')
      do i = 1, size(search%tried)
         associate (trial => search%tried(i))
            call json%open('{', '')
            call json%put('value', trial%value)
            call json%put('stable', trial%stable)
            call json%put('steps', trial%steps)
            call json%put('unbalanced', trial%unbalanced)
            call json%put('displacement', trial%displacement)
            call json%put('seconds', trial%seconds)
            call json%close('}')
         end associate
      end do
      call json%close(']')
      if (found .and. size(failing%supports) > 0) call put_supports(search, failing, json)
      call json%open('{', 'mechanism')
      blocks = [integer ::]
      if (found) blocks = moving_blocks(search, failing)
      call json%put('blocks', blocks - 1)
      if (found) blocks = moving_segments(search, failing)
      if (found .and. any(blocks > 0)) then
         call json%open('[', 'linings')
         do i = 1, size(blocks)
            if (blocks(i) > 0) call json%put('', liner_name(search, i))
         end do
         call json%close(']')
      end if
      kind = ''
      if (found) kind = kind_of(failing%mechanism)
      call json%put('kind', kind, found)
      call json%close('}')
      call json%put('moving_share', search%share_that_moves(), found)
      call put_messages(json, messages, none)
      call json%close('}')
      call print_line(json%text, ok)
   end subroutine print_json

end module rockdda_app_command_fos
